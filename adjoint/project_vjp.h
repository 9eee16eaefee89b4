// The reverse of the block projection, once for every constraint and every solver. With cotangents x'_bar and lambda'_bar:
//
//   y = A^-1 (lambda'_bar + J W x'_bar)        s_bar = -y/(1+g)        z = x'_bar - J^T y        dx = W J^T dl
//   v_j = dl_j W z - y_j dx                    one direction per scalar constraint
//   x_bar = z + sum_j Hess(C_j) v_j            lambda_bar = lambda'_bar + a s_bar      a_bar = s_bar . lambda'
//   w_bar_i = (J^T dl)_i . z_i                 g_bar = s_bar . (C - C_r + J dx)        C_r_bar = -g s_bar
//   p_bar = sum_j -y_j dC_j/dp + v_j . dJ_j/dp
//
// Only "solve with A" differs between solvers. Hess(C_j) v_j and the parameter derivatives are one evaluation of the constraint on dual
// numbers with rows + parameters directions. DERIVATION.md beside this file derives it.
#pragma once

#include "core/scalar/dual.h"
#include "core/solver/substep.h"

namespace sheetbend {

// Cotangents during the reverse of one substep.
template <class T>
struct SubstepCotangent {
  T* x;       // of the coordinates
  T* fixed;   // of pinned and driven nodes, kept per stencil (constraints of one color may share such a node)
  T* lambda;  // of the multipliers
  T* w;       // of the effective inverse masses, accumulated
  T* C_r;     // of the damping references, accumulated
  Inputs<T> inputs;
};

// Block-wide vectors of one reverse: z = x'_bar - J^T y and u = J^T dl.
template <class T>
struct BlockVectors {
  T *z, *u;
};

// Everything after the solve, on one element; z and u are the block's, on the element's stencil. Adds Hess(C_j) v_j to x_bar.
template <class K, class T>
void pull_back_element(const SubstepState<T>& s, const Group& group, int item, const Element<K, T>& e, const T* lambda,
                       const T* dl, const T* y, const T* z, const T* u, T* x_bar, const SubstepCotangent<T>& bar) {
  constexpr int P = parameter_count<K>, N = K::rows + P;
  using D = Dual<T, N>;
  T v[K::rows][K::dofs];
  D x[K::dofs], p[P > 0 ? P : 1], C[K::rows], J[K::rows * K::dofs];
  for (int d = 0; d < K::dofs; ++d) {
    x[d].v = e.x[d];
    for (int j = 0; j < K::rows; ++j) x[d].d[j] = v[j][d] = e.w[d / 3] * (dl[j] * z[d] - y[j] * u[d]);
  }
  for (int k = 0; k < P; ++k) {
    p[k].v = e.p[k];
    p[k].d[K::rows + k] = T(1.0);
  }
  K::evaluate(x, p, C, J);

  T a_bar(0.0), g_bar(0.0);
  for (int j = 0; j < K::rows; ++j) {
    const int row = e.first_row + j;
    const T s_bar = -(y[j] / (T(1.0) + e.rates.g));
    for (int d = 0; d < K::dofs; ++d) x_bar[d] += J[j * K::dofs + d].d[j];
    a_bar += s_bar * (lambda[j] + dl[j]);
    bar.lambda[row] += e.rates.a * s_bar;
    if (group.damped) {
      T J_dx(0.0);
      for (int d = 0; d < K::dofs; ++d) J_dx += J[j * K::dofs + d].v * e.w[d / 3] * u[d];
      g_bar += s_bar * (difference<K>(C[j].v, s.C_r[row]) + J_dx);
      bar.C_r[row] -= e.rates.g * s_bar;
    }
    for (int k = 0; k < P; ++k) {
      T p_bar = -(y[j] * C[j].d[K::rows + k]);
      for (int d = 0; d < K::dofs; ++d) p_bar += v[j][d] * J[j * K::dofs + d].d[K::rows + k];
      bar.inputs.of(Quantity::rest)[group.first_value + static_cast<std::size_t>(item) * P + k] += p_bar;
    }
  }
  // a = alpha/eta^2, g = alpha beta/eta
  const int c = group.first + item;
  T& alpha_bar = bar.inputs.of(Quantity::compliance)[c];
  alpha_bar += a_bar * T(1.0 / (s.eta * s.eta));
  if (group.damped) {
    const T alpha = s.inputs.of(Quantity::compliance)[c], beta = s.inputs.of(Quantity::damping)[c],
            ge = g_bar * T(1.0 / s.eta);
    alpha_bar += ge * beta;
    bar.inputs.of(Quantity::damping)[c] += ge * alpha;
  }
}

template <class K>
std::size_t first_coordinate(const Group& group, int item) {
  return group.first_coordinate + static_cast<std::size_t>(item) * K::dofs;
}

// Adds a stencil's cotangent to where it belongs.
template <class K, class T>
void add_cotangent(const SubstepState<T>& s, const Element<K, T>& e, std::size_t coordinate, const T* local,
                   const SubstepCotangent<T>& bar) {
  for (int k = 0; k < K::arity; ++k) {
    T* to =
        s.scene.role[e.nodes[k]] == Role::free ? bar.x + s.scene.first_dof[e.nodes[k]] : bar.fixed + coordinate + 3 * k;
    for (int d = 0; d < 3; ++d) to[d] += local[3 * k + d];
  }
}

// Gathers a per-dof vector on the stencil; zero where nothing can move.
template <class K, class T>
void gather_free(const SubstepState<T>& s, const Element<K, T>& e, const T* from, T* local) {
  for (int d = 0; d < K::dofs; ++d)
    local[d] = s.scene.role[e.nodes[d / 3]] == Role::free ? from[s.scene.first_dof[e.nodes[d / 3]] + d % 3] : T(0.0);
}

// lambda'_bar + J W x'_bar on one element.
template <class K, class T>
void adjoint_right_side(const SubstepState<T>& s, const Element<K, T>& e, const T* J, const SubstepCotangent<T>& bar,
                        T* y) {
  T x_bar[K::dofs];
  gather_free(s, e, bar.x, x_bar);
  for (int j = 0; j < K::rows; ++j) {
    T sum = bar.lambda[e.first_row + j];
    for (int d = 0; d < K::dofs; ++d) sum += J[j * K::dofs + d] * (e.w[d / 3] * x_bar[d]);
    y[j] = sum;
  }
}

template <class T>
void project_color_vjp(const SubstepState<T>& s, const SolverOptions& options, const Color& color,
                       const IterationRecord<T>& record, const SubstepCotangent<T>& bar) {
  const Group& group = s.scene.groups[color.group];
  with_kind(group.kind, [&]<class K>(K) {
    parallel_for(static_cast<int>(color.items.size()), options.threads, options.grain, [&](int begin, int end) {
      for (int n = begin; n < end; ++n) {
        const int item = color.items[n];
        const std::size_t coordinate = first_coordinate<K>(group, item);
        const Element<K, T> e(s, group, item, &record.x[coordinate]);
        const Evaluation<K, T> value(e.x, e.p);
        const T* dl = &record.dl[e.first_row];
        T A[K::rows * K::rows], y[K::rows], z[K::dofs], u[K::dofs]{}, back[K::dofs]{};
        e.matrix(value.J, A);
        adjoint_right_side(s, e, value.J, bar, y);
        SmallLdlt<K::rows, T>(A).solve(y);
        transpose_times<K>(value.J, dl, u);
        transpose_times<K>(value.J, y, back);
        gather_free(s, e, bar.x, z);
        for (int d = 0; d < K::dofs; ++d) {
          z[d] -= back[d];
          back[d] = -back[d];
        }
        for (int k = 0; k < K::arity; ++k)
          if (s.scene.role[e.nodes[k]] == Role::free) bar.w[e.nodes[k]] += dot(Vec3<T>(u + 3 * k), Vec3<T>(z + 3 * k));
        pull_back_element<K>(s, group, item, e, &record.lambda[e.first_row], dl, y, z, u, back, bar);
        add_cotangent(s, e, coordinate, back, bar);
      }
    });
  });
}

// The block touches its own movable nodes of z and u only.
template <class T>
void project_block_vjp(const SubstepState<T>& s, const DirectBlock& block, const IterationRecord<T>& record,
                       const Factor<T>& factor, T* rows, const BlockVectors<T>& block_wide,
                       const SubstepCotangent<T>& bar) {
  T* y = rows + block.first_row;
  const auto for_each_member = [&](auto&& body) {
    for (const Member& m : block.members) {
      const Group& group = s.scene.groups[m.group];
      with_kind(group.kind, [&]<class K>(K) {
        const Element<K, T> e(s, group, m.item, &record.x[first_coordinate<K>(group, m.item)]);
        body(e, &record.J[first_gradient<K>(group, m.item)], group, m);
      });
    }
  };
  for_each_member([&]<class K>(const Element<K, T>& e, const T* J, const Group&, const Member& m) {
    adjoint_right_side(s, e, J, bar, y + m.first_row);
  });
  factor.solve(block.structure, y);
  for (const int node : block.nodes) std::fill_n(block_wide.u + s.scene.first_dof[node], 3, T(0.0));
  for_each_member([&]<class K>(const Element<K, T>& e, const T* J, const Group& group, const Member& m) {
    T u[K::dofs]{}, back[K::dofs]{};
    transpose_times<K>(J, &record.dl[e.first_row], u);
    transpose_times<K>(J, y + m.first_row, back);
    for (int d = 0; d < K::dofs; ++d) back[d] = -back[d];
    for (int d = 0; d < K::dofs; ++d)
      if (s.scene.role[e.nodes[d / 3]] == Role::free) block_wide.u[s.scene.first_dof[e.nodes[d / 3]] + d % 3] += u[d];
    add_cotangent(s, e, first_coordinate<K>(group, m.item), back, bar);
  });
  for (const int node : block.nodes) {
    const int dof = s.scene.first_dof[node];
    std::copy_n(bar.x + dof, 3, block_wide.z + dof);
    bar.w[node] += dot(Vec3<T>(block_wide.u + dof), Vec3<T>(block_wide.z + dof));
  }
  for_each_member([&]<class K>(const Element<K, T>& e, const T*, const Group& group, const Member& m) {
    T z[K::dofs], u[K::dofs], x_bar[K::dofs]{};
    gather_free(s, e, block_wide.z, z);
    gather_free(s, e, block_wide.u, u);
    pull_back_element<K>(s, group, m.item, e, &record.lambda[e.first_row], &record.dl[e.first_row], y + m.first_row, z,
                         u, x_bar, bar);
    add_cotangent(s, e, first_coordinate<K>(group, m.item), x_bar, bar);
  });
}

}  // namespace sheetbend
