#include "core/step/yield.h"

namespace sheetbend {

void slider_by_parameters(int kind, const double* x, const double* p, double* by_p) {
  with_kind(kind, [&]<class K>(K) {
    if constexpr (Yields<K>) {
      constexpr int inside = inside_slider<K>;
      Dual<double, inside> at[K::dofs], with[parameter_count<K>], C[K::rows], J[K::rows * K::dofs];
      for (int d = 0; d < K::dofs; ++d) at[d].v = x[d];
      for (int k = 0; k < parameter_count<K>; ++k) with[k].v = p[k];
      for (int k = 0; k < inside; ++k) with[k].d[k] = 1.0;
      Slider<K>::evaluate(at, with, C, J);
      for (int j = 0; j < K::rows; ++j) std::copy_n(C[j].d, inside, by_p + j * inside);
    }
  });
}

}  // namespace sheetbend
