// Tangents of the block projection: derivatives of what the kernels of plain numbers compute, along eight directions at once. With J' for the
// derivative of J along the directions, z = W J^T dl and everything else that stands still, A dl = s gives
//   A dl' = s' - (a/(1+g))' dl - J' z - J z',  z' = W' J^T dl + W J'^T dl,
// so the matrix is factored once, in plain numbers, and J' lives no longer than its member is looked at.
#pragma once

#include "core/blocks/block_forward.h"
#include "core/packs/tangent.h"

namespace sheetbend {

// One member's values, from packs of eight members.
template <class K>
struct MemberValues {
  const sheetbend_blocks::Run& run;
  const double* directions;
  int n, lane;
  Tangent operator[](int part) const {
    const int count = sheetbend_blocks::value_count(run.damped, parameter_count<K>);
    return tangent_at(run.values, directions, lane_at(n, count, part), lane);
  }
  void parameters(Tangent* p) const {
    for (int k = 0; k < parameter_count<K>; ++k) p[k] = (*this)[sheetbend_blocks::value_count(run.damped, 0) + k];
  }
};

template <class K>
void load_tangents(const double* rows, const double* directions, const int* nodes, int lane, Tangent* x) {
  unrolled<K::dofs>(
      [&](auto d) { x[d] = tangent_at(rows, directions, nodes[d / 3 * Pack::lanes] + long(d % 3), lane); });
}

// One member's share of the right side without J z', and of J'^T dl.
template <class K>
void tangents_of_member(const sheetbend_blocks::Block& b, const sheetbend_blocks::Tangents& t, int r, int n, int lane) {
  const sheetbend_blocks::Run& run = b.runs[r];
  const int* nodes = indices_of<Tangent>(run.nodes, K::arity, n);
  const int row = *indices_of<Tangent>(run.first_row, 1, n);
  const MemberValues<K> values{run, t.values[r], n, lane};
  Element<K, Tangent> e;
  load_tangents<K>(b.x, t.x, nodes, lane, e.x);
  e.rates.a = values[0];
  if (run.damped) {
    e.rates.g = values[1];
    e.rates.scale = values[2];
  }
  values.parameters(e.p);
  const Evaluation<K, Tangent> value(e.x, e.p);
  double z[K::dofs];
  Register push[K::dofs];
  unrolled<K::dofs>([&](auto d) {
    const int particle = nodes[d / 3 * Pack::lanes];
    z[d] = b.x[particle + 3] * b.u[particle + d % 3];
    push[d] = Register(0.0);
  });
  unrolled<K::rows>([&](auto j) {
    Tangent lambda[K::rows], C_r[K::rows];
    lambda[j] = tangent_at(b.lambda, t.lambda, row + j, lane);
    if (run.damped) C_r[j] = tangent_at(b.C_r, t.C_r, row + j, lane);
    const Register dl(b.dl[row + j]);
    Register sum = -(e.residual(value.C, lambda, run.damped ? C_r : nullptr, j) * e.rates.scale).d[0] -
                   (e.rates.a * e.rates.scale).d[0] * dl;
    unrolled<K::dofs>([&](auto d) {
      sum -= value.J[j * K::dofs + d].d[0] * Register(z[d]);
      push[d] += value.J[j * K::dofs + d].d[0] * dl;
    });
    directions_at(t.dl, row + j, lane) = sum;
  });
  unrolled<K::dofs>([&](auto d) { directions_at(t.u, nodes[d / 3 * Pack::lanes] + long(d % 3), lane) += push[d]; });
}

template <class K>
void tangents_of_run(const sheetbend_blocks::Block& b, const sheetbend_blocks::Tangents& t, int r) {
  for (int n = 0; n < b.runs[r].count; ++n)
    for (int lane = 0; lane < Pack::lanes; lane += register_lanes) tangents_of_member<K>(b, t, r, n, lane);
}

// Whether C depends on its parameters by a factor and by what is subtracted alone, see concept.h.
template <class K>
inline constexpr bool has_plain_parameters = parameter_count<K> == K::factors + K::offsets;

// C' = J x' and what the parameters add. The gradients of eight members are found at a time, with a factor as if it were one.
template <class K>
void values_tangents_by_gradient(const sheetbend_blocks::Values& b, const sheetbend_blocks::ValueTangents& t, int r) {
  const sheetbend_blocks::Run& run = b.runs[r];
  for (int first = 0; first < run.count; first += Pack::lanes) {
    const int* nodes = indices_of<Tangent>(run.nodes, K::arity, first);
    Pack x[K::dofs], unused, p[parameter_count<K> + 1];
    for (int k = 0; k < K::arity; ++k) load_particle(b.x, nodes + k * Pack::lanes, x + 3 * k, unused);
    for (int k = 0; k < parameter_count<K>; ++k) p[k] = Pack(k < K::factors ? 1.0 : 0.0);
    const Evaluation<K, Pack> value(x, p);
    const auto *C = reinterpret_cast<const double*>(value.C), *J = reinterpret_cast<const double*>(value.J);
    for (int member = 0; member < std::min(Pack::lanes, run.count - first); ++member)
      for (int lane = 0; lane < Pack::lanes; lane += register_lanes) {
        const MemberValues<K> values{run, t.values[r], first + member, lane};
        Tangent own[parameter_count<K> + 1];
        values.parameters(own);
        unrolled<K::rows>([&](auto j) {
          Register sum(0.0);
          unrolled<K::dofs>([&](auto d) {
            sum += Register(J[(j * K::dofs + d) * Pack::lanes + member]) *
                   directions_at(t.x, nodes[d / 3 * Pack::lanes + member] + long(d % 3), lane);
          });
          if constexpr (K::factors > 0 && j == K::rows - 1)
            sum = own[0].v * sum + Register(C[j * Pack::lanes + member]) * own[0].d[0];
          if constexpr (j < K::offsets) sum -= own[K::factors + j].d[0];
          directions_at(t.C, *indices_of<Tangent>(run.first_row, 1, first + member) + j, lane) = sum;
        });
      }
  }
}

template <class K>
void values_tangents_on_duals(const sheetbend_blocks::Values& b, const sheetbend_blocks::ValueTangents& t, int r) {
  const sheetbend_blocks::Run& run = b.runs[r];
  for (int n = 0; n < run.count; ++n)
    for (int lane = 0; lane < Pack::lanes; lane += register_lanes) {
      Tangent x[K::dofs], p[parameter_count<K> > 0 ? parameter_count<K> : 1];
      load_tangents<K>(b.x, t.x, indices_of<Tangent>(run.nodes, K::arity, n), lane, x);
      MemberValues<K>{run, t.values[r], n, lane}.parameters(p);
      const Evaluation<K, Tangent> value(x, p);
      const int row = *indices_of<Tangent>(run.first_row, 1, n);
      for (int j = 0; j < K::rows; ++j) directions_at(t.C, row + j, lane) = value.C[j].d[0];
    }
}

template <class K>
void values_tangents_of_run(const sheetbend_blocks::Values& b, const sheetbend_blocks::ValueTangents& t, int r) {
  if constexpr (has_plain_parameters<K>)
    values_tangents_by_gradient<K>(b, t, r);
  else
    values_tangents_on_duals<K>(b, t, r);
}

struct TangentKernels {
  using Block = sheetbend_blocks::Block;
  using Tangents = sheetbend_blocks::Tangents;

  // Reads x, lambda and dl before push() writes over them, and leaves z' in u.
  static void right_side(const Block& b, const Tangents& t) {
    Pack *u = numbers_of<Pack>(t.u), *right = numbers_of<Pack>(t.dl);
    const Pack* x = numbers_of<Pack>(static_cast<const double*>(t.x));
    for (int p = 0; p < b.particles; ++p) {
      const long at = sheetbend_blocks::row * static_cast<long>(p);
      (p < b.movable ? transpose_times_at<double>(b, p, b.dl) : Vec3<double>()).store(b.u + at);
      for (int d = 0; d < 3; ++d) u[at + d] = Pack(0.0);
    }
    for (int r = 0; r < b.run_count; ++r) of_kind[b.runs[r].kind](b, t, r);
    for (int p = 0; p < b.movable; ++p) {
      const long at = sheetbend_blocks::row * static_cast<long>(p);
      for (int d = 0; d < 3; ++d) u[at + d] = x[at + 3] * Pack(b.u[at + d]) + Pack(b.x[at + 3]) * u[at + d];
      for (int k = b.window[p]; k < b.window[p + 1]; ++k) {
        const double* G = b.gradients + sheetbend_blocks::row * static_cast<long>(k);
        right[b.rows[k]] -= Pack(G[0]) * u[at] + Pack(G[1]) * u[at + 1] + Pack(G[2]) * u[at + 2];
      }
    }
  }

  static void solve(const Block& b, double* right_side) {
    with_band(b.band,
              [&]<int Band>() { solve_band<Band>(b.size, b.band, b.matrix, b.inverse, numbers_of<Pack>(right_side)); });
  }

  static void push(const Block& b, const Tangents& t) {
    const Pack *dl = numbers_of<Pack>(t.dl), *u = numbers_of<Pack>(t.u);
    const Pack *x = numbers_of<Pack>(t.x), *lambda = numbers_of<Pack>(t.lambda);
    Pack *x_next = numbers_of<Pack>(t.x_next), *lambda_next = numbers_of<Pack>(t.lambda_next);
    for (int p = 0; p < b.particles; ++p) {
      const long at = sheetbend_blocks::row * static_cast<long>(p);
      for (int d = 0; d < 3; ++d) {
        Pack sum(0.0);
        if (p < b.movable) {
          for (int k = b.window[p]; k < b.window[p + 1]; ++k)
            sum += Pack(b.gradients[sheetbend_blocks::row * static_cast<long>(k) + d]) * dl[b.rows[k]];
          sum = u[at + d] + Pack(b.x[at + 3]) * sum;
        }
        x_next[at + d] = x[at + d] + sum;
      }
      x_next[at + 3] = x[at + 3];
    }
    for (int j = 0; j < b.size; ++j) lambda_next[j] = lambda[j] + dl[j];
  }

  static void values(const sheetbend_blocks::Values& b, const sheetbend_blocks::ValueTangents& t) {
    for (int r = 0; r < b.run_count; ++r)
      if (b.runs[r].damped) values_of[b.runs[r].kind](b, t, r);
  }

  static void refer(const sheetbend_blocks::References& b, int size, const sheetbend_blocks::ReferenceTangents& t) {
    const Pack *C = numbers_of<Pack>(t.C), *C_before = numbers_of<Pack>(t.C_before);
    Pack* C_r = numbers_of<Pack>(t.C_r);
    for (int j = 0; j < size; ++j) C_r[j] = b.before == 0.0 ? C[j] : C[j] - Pack(b.before) * (C[j] - C_before[j]);
  }

  static constexpr auto of_kind = []<class... K>(std::tuple<K...>*) {
    return std::array{&tangents_of_run<K>...};
  }(static_cast<Registry*>(nullptr));

  static constexpr auto values_of = []<class... K>(std::tuple<K...>*) {
    return std::array{&values_tangents_of_run<K>...};
  }(static_cast<Registry*>(nullptr));

  static constexpr sheetbend_blocks::TangentKernels all{&right_side, &solve, &push, &values, &refer};
};

}  // namespace sheetbend
