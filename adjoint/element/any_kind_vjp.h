// The reverse of a constraint whose kind is a number (core/constraints/any_kind.h), compiled once per kind and scalar (any_kind_vjp*.cpp).
#pragma once

#include "core/constraints/any_kind.h"

namespace sheetbend {

// values_vjp() of constraint_vjp.h.
template <class T>
void values_vjp(int kind, const T* x, const T* p, const T* C_bar, T* x_bar, T* p_bar);

// pushes_vjp() of pushes_vjp.h.
template <class T>
void pushes_vjp(int kind, const T* x, const T* p, const T* lambda, const T* y, const T* z, T* x_bar, T* p_bar);

}  // namespace sheetbend
