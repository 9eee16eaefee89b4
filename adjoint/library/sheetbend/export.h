/// @file
/// What every public header begins with: the visibility of what is public, and the version's namespace.
#pragma once

/// Marks what a shared library shows; everything else is hidden.
#define SHEETBEND_API __attribute__((visibility("default")))

/// Programs write `sheetbend::Scene`; the linker sees `sheetbend::v0::Scene`, so that no symbol meets one of the
/// library's own parts or of another version. The library itself is compiled with SHEETBEND_BUILDING.
#ifdef SHEETBEND_BUILDING
#define SHEETBEND_INLINE
#else
#define SHEETBEND_INLINE inline
#endif
