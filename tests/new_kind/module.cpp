// What Python knows of the kinds, without the rest of sheetbend._core.
#include "python/bindings/core_module.h"

PYBIND11_MODULE(kinds_alone, m) { sheetbend::bindings::bind_kinds(m); }
