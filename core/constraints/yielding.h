// Yielding<Elastic>: an elastic kind with internal friction, C = C_elastic - share set, row by row.
// Two springs in parallel, one of which slides: of the stiffness the part `share` belongs to a spring that begins at the set (the last nodes of the
// stencil, one number per row) and slides along when its own strain e = C_elastic - set grows longer than `yield` over all rows together: kinematic
// hardening (Prager 1956), a Jenkin element beside a spring. Their sum has the gradient of one spring of the whole stiffness about rest + share set,
// which is what C says; yield.h moves the set. The parameters are the elastic ones with the one that makes the share and `yield` before those that are just
// subtracted.
#pragma once

#include "core/constraints/concept.h"

namespace sheetbend {

// Nodes that hold the set.
template <class K>
inline constexpr int set_nodes = (K::rows + 2) / 3;

// What makes the share: itself, or how much stiffer the spring beside is than the sliding one.
struct ShareItself {
  static constexpr Parameter parameter{"share", units::none, ranges::from_zero_below_one, defaults::given};
  template <class T>
  static T share(const T& p) {
    return p;
  }
  template <class T>
  static T slope(const T&) {
    return T(1.0);
  }
};
struct Hardening {
  static constexpr Parameter parameter{"hardening", units::none, Range{0.0}, defaults::given};
  template <class T>
  static T share(const T& p) {
    return T(1.0) / (T(1.0) + p);
  }
  template <class T>
  static T slope(const T& p) {
    return -(share(p) * share(p));
  }
};

template <class Elastic, class Part = ShareItself>
struct Yielding : OnPoints<Elastic::arity + set_nodes<Elastic>> {
  static constexpr int points = Elastic::points;
  static constexpr Unit unit = Elastic::unit;
  static constexpr Compliance compliance = Elastic::compliance;
  static constexpr int rows = Elastic::rows, dofs = Elastic::dofs + 3 * set_nodes<Elastic>, offsets = Elastic::offsets;
  static constexpr int share_parameter = parameter_count<Elastic> - offsets, yield_parameter = share_parameter + 1;
  static constexpr auto parameters = [] {
    std::array<Parameter, Elastic::parameters.size() + 2> all{};
    const auto own = std::copy_n(Elastic::parameters.begin(), share_parameter, all.begin());
    own[0] = Part::parameter;
    own[1] = {"yield", unit, ranges::positive, defaults::given};
    std::copy(Elastic::parameters.begin() + share_parameter, Elastic::parameters.end(), own + 2);
    return all;
  }();

  template <class T>
  static T share(const T* p) {
    return Part::share(p[share_parameter]);
  }

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    const T part = share(p);
    T inner_J[rows * set];
    Elastic::evaluate(x, ElasticParameters<T>(p).p, C, inner_J);
    for (int j = 0; j < rows; ++j) {
      C[j] = C[j] - part * x[set + j];
      for (int d = 0; d < set; ++d) J[j * dofs + d] = inner_J[j * set + d];
      for (int d = 0; set + d < dofs; ++d) J[j * dofs + set + d] = d == j ? -part : T(0.0);
    }
  }

  // Shortcuts of the elastic kind (concept.h) go on to be shortcuts: the set adds -share to the diagonal of J.
  template <class T>
    requires HasFactors<Elastic>
  struct Factors {
    typename Elastic::template Factors<T> elastic;
    T C[rows], share;

    Factors(const T* x, const T* p) : elastic(x, ElasticParameters<T>(p).p), share(Yielding::share(p)) {
      for (int j = 0; j < rows; ++j) C[j] = elastic.C[j] - share * x[set + j];
    }
    void gradient(T* J) const {
      T inner_J[rows * set];
      elastic.gradient(inner_J);
      for (int j = 0; j < rows; ++j) {
        for (int d = 0; d < set; ++d) J[j * dofs + d] = inner_J[j * set + d];
        for (int d = 0; set + d < dofs; ++d) J[j * dofs + set + d] = d == j ? -share : T(0.0);
      }
    }
    void matrix(const T* w, T* A) const {
      elastic.matrix(w, A);
      for (int j = 0; j < rows; ++j) A[j * rows + j] += share * share * w[Elastic::arity + j / 3];
    }
    void add_times(const T* v, T* y) const {
      elastic.add_times(v, y);
      for (int j = 0; j < rows; ++j) y[j] -= share * v[set + j];
    }
    void transpose_times(const T* y, T* out) const {
      elastic.transpose_times(y, out);
      for (int d = 0; set + d < dofs; ++d) out[set + d] = d < rows ? -share * y[d] : T(0.0);
    }
  };

  template <class T>
    requires HasReverse<Elastic>
  static void reverse(const T* x, const T* p, const T* dl, const T* y, const T* a, const T* b, T* x_bar, T* p_bar) {
    const ElasticParameters<T> elastic(p);
    T elastic_bar[parameter_count<Elastic> + 1]{};
    Elastic::reverse(x, elastic.p, dl, y, a, b, x_bar, elastic_bar);
    elastic.add(elastic_bar, p_bar);
    const T slope = Part::slope(p[share_parameter]);
    for (int j = 0; j < rows; ++j)
      p_bar[share_parameter] += slope * (y[j] * (x[set + j] + b[set + j]) - dl[j] * a[set + j]);
  }

  // The set's coordinates come last, and C is linear in them.
  template <class T>
    requires HasHessian<Elastic>
  static void add_hessian(const T* x, const T* p, const T* lambda, T* H) {
    Elastic::add_hessian(x, ElasticParameters<T>(p).p, lambda, H);
  }

 private:
  static constexpr int set = Elastic::dofs;

  // Those of the elastic kind among p.
  template <class T>
  struct ElasticParameters {
    T p[parameter_count<Elastic> + 1];
    explicit ElasticParameters(const T* all) {
      for (int k = 0; k < parameter_count<Elastic>; ++k) p[k] = all[place(k)];
    }
    void add(const T* own, T* all) const {
      for (int k = 0; k < parameter_count<Elastic>; ++k) all[place(k)] += own[k];
    }
    static constexpr int place(int k) { return k < share_parameter ? k : k + 2; }
  };
};

}  // namespace sheetbend
