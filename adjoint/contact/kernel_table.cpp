// Compiled once per instruction set, like adjoint/packs/kernel_table.cpp.
#include "adjoint/contact/contact_kernels_vjp.h"

#define SHEETBEND_JOIN_(a, b) a##b
#define SHEETBEND_JOIN(a, b) SHEETBEND_JOIN_(a, b)

namespace {

template <class S>
constexpr sheetbend_contacts::Kernels kernels_of() {
  using Forward = sheetbend::ContactKernels<S>;
  using Reverse = sheetbend::ContactKernelsVjp<S>;
  if constexpr (std::is_same_v<S, sheetbend::DistanceField>)
    return {};
  else
    return {&Forward::project, &Forward::carry, &Forward::begins, &Reverse::project_vjp, &Reverse::carry_vjp};
}

constexpr auto shapes = []<class... S>(std::tuple<S...>*) {
  return std::array{kernels_of<S>()...};
}(static_cast<sheetbend::Shapes*>(nullptr));

}  // namespace

extern "C" const sheetbend_contacts::Table SHEETBEND_JOIN(sheetbend_contacts_, SHEETBEND_VARIANT){
    shapes.data(), &sheetbend::contact_numbers_vjp, SHEETBEND_VARIANT_NAME};
