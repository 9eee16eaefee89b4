"""The values of a journal as bytes: sealed with a digest, and Jacobians without their zeros."""

from __future__ import annotations

import hashlib

import numpy as np

SEAL = 8  # bytes of the digest behind every value: SQLite does not see damage inside of one


def seal(key: bytes, value: bytes) -> bytes:
    """A value with a digest of it behind."""
    return value + hashlib.blake2b(value, key=key, digest_size=SEAL).digest()


def unseal(key: bytes, sealed: bytes) -> bytes:
    """The value.

    Raises:
        ValueError, TypeError: it was changed.
    """
    value = bytes(sealed[:-SEAL])
    if seal(key, value) != sealed:
        raise ValueError("is damaged")
    return value


def pack(jacobian: np.ndarray) -> bytes:
    """Which numbers have bits that are not zero, and those numbers. Most of a Jacobian with private parameters is
    zero."""
    flat = np.ascontiguousarray(jacobian).ravel()
    there = flat.view(np.uint64) != 0
    return np.packbits(there).tobytes() + flat[there].tobytes()


def unpack(packed: bytes, rows: int, columns: int) -> np.ndarray:
    bits = (rows * columns + 7) // 8
    there = np.unpackbits(np.frombuffer(packed, np.uint8, bits), count=rows * columns).astype(bool)
    flat = np.zeros(rows * columns)
    flat[there] = np.frombuffer(packed, offset=bits)
    return flat.reshape(rows, columns)
