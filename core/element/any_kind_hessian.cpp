#include "core/element/any_kind_hessian.h"

#include <array>

#include "core/element/second_order.h"

namespace sheetbend {
namespace {

template <class K>
void add_hessian(const double* x, const double* p, const double* lambda, double* J, double* H) {
  const SecondOrder<K, double> at(x, p);
  at.add_hessian(lambda, H);
  std::copy(std::begin(at.J), std::end(at.J), J);
}

}  // namespace

void add_hessian(int kind, const double* x, const double* p, const double* lambda, double* J, double* H) {
  using Add = void (*)(const double*, const double*, const double*, double*, double*);
  static constexpr auto of_kind = []<class... K>(std::tuple<K...>*) {
    return std::array<Add, kind_count>{add_hessian<K>...};
  }(static_cast<Registry*>(nullptr));
  of_kind.at(kind)(x, p, lambda, J, H);
}

}  // namespace sheetbend
