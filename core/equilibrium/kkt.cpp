#include "core/equilibrium/kkt.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/element/any_kind_hessian.h"
#include "core/equilibrium/residual.h"

namespace sheetbend {

double largest(const std::vector<double>& v) {
  double m = 0.0;
  for (const double a : v) m = std::max(m, std::abs(a));
  return m;
}

namespace {

double ratio(double part, double whole) { return part == 0.0 ? 0.0 : part / whole; }

// How much stiffer than the geometric stiffness a row of K may be; refinement gains about as many digits per pass.
constexpr double rigid_stiffness = 1e8;

}  // namespace

void Kkt::assemble(const double* inputs, const double* x, const double* lambda, double force_stiffness,
                   const std::vector<RedundantRow>& left_out) {
  const Inputs<const double> in{scene_.layout, inputs};
  force_stiffness_ = force_stiffness;
  double *H = H_.data(), *J = J_.data();
  double local[largest_kind.dofs], own[triangle(largest_kind.dofs)];
  for_each_constraint(scene_, [&](const Group& group, int item) {
    const int dofs = 3 * group.arity;
    gather(scene_, group, item, x, local);
    std::fill_n(own, triangle(dofs), 0.0);
    add_hessian(group.kind, local, rest_parameters(in, group, item), lambda + group.first_row + item * group.rows, J,
                own);
    for (int a = 0; a < dofs; ++a)
      for (int b = 0; b < dofs; ++b) *H++ = own[a >= b ? triangle(a) + b : triangle(b) + a];
    J += group.rows * dofs;
  });
  for (const RedundantRow& r : left_out) {
    const Group& group = group_of(scene_, r.row);
    const std::size_t dofs = 3 * static_cast<std::size_t>(group.arity);
    std::fill_n(&J_[group.first_gradient + (r.row - group.first_row) * dofs], dofs, 0.0);
  }
  press(in, x, lambda, H);
  measure_idle(in, x);
}

// H of what is under pressure, from here on, and the gradients of the kept volumes.
void Kkt::press(const Inputs<const double>& in, const double* x, const double* lambda, double* H) {
  const double* given = in.of(Quantity::pressure);
  std::vector<double> pressures(given, given + scene_.air.size());
  std::vector<Vec3<double>> gradient;
  for (int v = 0; v < static_cast<int>(border_.size()); ++v) {
    pressures.insert(pressures.end(), scene_.volumes[v].triangles.size(), lambda[scene_.rows + v]);
    kept_volume(scene_, in, v, x, gradient);
    for (std::size_t k = 0; k < gradient.size(); ++k) gradient[k].store(&border_[v][3 * k]);
  }
  for (std::size_t i = 0; i < pressed_.size(); ++i, H += 81)
    pressure_hessian(corners_at(scene_, pressed_[i], x), pressures[i], H);
}

// The directions of directors that nothing depends on, and the metric.
void Kkt::measure_idle(const Inputs<const double>& in, const double* x) {
  for (std::size_t i = 0; i < scene_.directors.size(); ++i) {
    const Director& d = scene_.directors[i];
    const auto at = [&](int node) { return x + scene_.first_dof[node]; };
    const double inverse_length = 1.0 / norm(Vec3<double>(at(d.head)) - Vec3<double>(at(d.tail)));
    double t[3]{}, m[3];
    if (d.is_normal()) {
      const Vec3<double> n(at(d.node));
      ((1.0 / norm(n)) * n).store(m);
    } else {
      const Across<double> frame = across_axis<double>(d, at);
      frame.t.store(t);
      frame.m1.store(m);
    }
    for (int e = 0; e < 9; ++e) idle_[i][e] = t[e / 3] * t[e % 3] + m[e / 3] * m[e % 3];
    std::fill_n(metric_.begin() + scene_.first_dof[d.node], 3, 1.0 / (inverse_length * inverse_length));
  }
  for (const Body& b : scene_.bodies)
    if (const double width = width_of_bodies({b}, in.of(Quantity::mass)); width > 0.0)
      for (const int n : b.axes) std::fill_n(metric_.begin() + scene_.first_dof[n], 3, 0.25 * width * width);
}

bool Kkt::factorize(double mu, const double* compliance) {
  mu_ = mu;
  alpha_.assign(compliance, compliance + scene_.constraints + scene_.volumes.size());
  std::fill_n(K_.valuePtr(), K_.nonZeros(), 0.0);
  add_geometric_stiffness();
  add_elastic_stiffness();
  double* values = K_.valuePtr();
  const int* at = contact_position_.data();
  for_each_contact_entry([&](std::size_t i, int e, double weights, int, int) {
    if (const int own = *at++; own >= 0) values[own] += weights * contacts_[i].symmetric[e];
  });
  hold_idle();
  largest_diagonal_ = 0.0;
  for (int i = 0; i < free_; ++i) largest_diagonal_ = std::max(largest_diagonal_, std::abs(values[diagonal_[i]]));
  for_each_border([&](int v, std::size_t i, int) {
    if (border_position_[v][i] >= 0) values[border_position_[v][i]] = -border_[v][i];
  });
  for (std::size_t v = 0; v < border_.size(); ++v) values[diagonal_[free_ + v]] = -alpha_[scene_.constraints + v];
  factor_.factorize(K_);
  if (factor_.info() != Eigen::Success || !factor_.vectorD().allFinite()) return false;
  negative_ = static_cast<int>((factor_.vectorD().array() < 0.0).count() - border_.size());
  return !slides_ || factorize_whole();
}

// mu - H
void Kkt::add_geometric_stiffness() {
  double* values = K_.valuePtr();
  for (std::size_t e = 0; e < H_.size(); ++e)
    if (position_[e] >= 0) values[position_[e]] -= H_[e];
  geometric_ = std::max(force_stiffness_, mu_);
  for (int i = 0; i < free_; ++i) geometric_ = std::max(geometric_, std::abs(values[diagonal_[i]]));
  for (int i = 0; i < scene_.dofs(); ++i)
    if (unknown_[i] >= 0) values[diagonal_[unknown_[i]]] += mu_ * metric_[i];
}

// J^T alpha^-1 J, with rigid rows softened.
void Kkt::add_elastic_stiffness() {
  double* values = K_.valuePtr();
  const int* position = position_.data();
  const double* J = J_.data();
  for_each_constraint(scene_, [&](const Group& group, int item) {
    const int rows = group.rows, dofs = 3 * group.arity;
    double J2 = 0.0;
    for (int e = 0; e < rows * dofs; ++e) J2 = std::max(J2, J[e] * J[e]);
    double& alpha = softened_[group.first + item];
    alpha = alpha_[group.first + item];
    if (J2 > 0.0 && geometric_ > 0.0) alpha = std::max(alpha, J2 / (rigid_stiffness * geometric_));
    if (alpha == 0.0) alpha = 1.0;  // a rigid row without any scale of stiffness
    for (int a = 0; a < dofs; ++a)
      for (int b = 0; b < dofs; ++b, ++position) {
        if (*position < 0) continue;
        double sum = 0.0;
        for (int j = 0; j < rows; ++j) sum += J[j * dofs + a] * J[j * dofs + b];
        values[*position] += sum / alpha;
      }
    J += rows * dofs;
  });
}

// Stiffness in the directions of directors that nothing depends on, as large as that of their other directions.
void Kkt::hold_idle() {
  double* values = K_.valuePtr();
  for (std::size_t i = 0; i < idle_.size(); ++i) {
    const int* at = &director_position_[9 * i];
    if (at[0] < 0) continue;
    idle_stiffness_[i] = std::max(values[at[0]] + values[at[4]] + values[at[8]], 1e-3 * geometric_);
    for (int e = 0; e < 9; ++e)
      if (at[e] >= 0) values[at[e]] += idle_stiffness_[i] * idle_[i][e];
  }
}

void Kkt::take_contacts(std::vector<ContactBlock> blocks) {
  contacts_ = std::move(blocks);
  slides_ = std::ranges::any_of(contacts_, &ContactBlock::slides);
}

bool Kkt::factorize_whole() {
  Eigen::SparseMatrix<double> K = K_.selfadjointView<Eigen::Upper>();
  for_each_contact_entry([&](std::size_t i, int e, double weights, int row, int column) {
    K.coeffRef(unknown_[row], unknown_[column]) += weights * (contacts_[i].whole[e] - contacts_[i].symmetric[e]);
  });
  if (!whole_) {
    whole_ = std::make_unique<Eigen::SparseLU<Eigen::SparseMatrix<double>>>();
    whole_->analyzePattern(K);
  }
  whole_->factorize(K);
  return whole_->info() == Eigen::Success;
}

// K x - g p = J^T alpha^-1 b_l - b_x,  lambda = alpha^-1 (b_l - J x), with the softened compliances;  -g.x - alpha p = -b_p.
void Kkt::condensed_solve(const std::vector<double>& b_x, const std::vector<double>& b_l, bool transposed,
                          std::vector<double>& x, std::vector<double>& lambda) const {
  Eigen::VectorXd b(K_.rows());
  for (int i = 0; i < scene_.dofs(); ++i)
    if (unknown_[i] >= 0) b[unknown_[i]] = -b_x[i];
  const auto for_each_gradient = [&](auto&& f) {
    const double* J = J_.data();
    for_each_constraint(scene_, [&](const Group& group, int item) {
      f(group, item, J, 1.0 / softened_[group.first + item]);
      J += group.rows * 3 * group.arity;
    });
  };
  double local[largest_kind.dofs];
  for_each_gradient([&](const Group& group, int item, const double* J, double stiffness) {
    const auto nodes = group.nodes(item);
    const int dofs = 3 * group.arity;
    transpose_times(group.rows, dofs, J, &b_l[group.first_row + item * group.rows], local);
    for (int d = 0; d < dofs; ++d)
      if (const int u = unknown_[scene_.first_dof[nodes[d / 3]] + d % 3]; u >= 0) b[u] += stiffness * local[d];
  });
  for (std::size_t v = 0; v < border_.size(); ++v) b[free_ + v] = -b_l[scene_.rows + v];
  Eigen::VectorXd solution;
  if (!slides_)
    solution = factor_.solve(b);
  else if (transposed)
    solution = whole_->transpose().solve(b);
  else
    solution = whole_->solve(b);
  for (std::size_t v = 0; v < border_.size(); ++v) lambda[scene_.rows + v] = solution[free_ + v];
  for (int i = 0; i < scene_.dofs(); ++i) x[i] = unknown_[i] >= 0 ? solution[unknown_[i]] : 0.0;
  for_each_gradient([&](const Group& group, int item, const double* J, double stiffness) {
    const int dofs = 3 * group.arity;
    gather(scene_, group, item, x.data(), local);
    for (int j = 0; j < group.rows; ++j) {
      const int row = group.first_row + item * group.rows + j;
      double sum = b_l[row];
      for (int d = 0; d < dofs; ++d) sum -= J[j * dofs + d] * local[d];
      lambda[row] = stiffness * sum;
    }
  });
}

// r -= A (x, lambda) or A^T (x, lambda), with the true compliances.
void Kkt::subtract_product(const std::vector<double>& x, const std::vector<double>& lambda, bool transposed,
                           std::vector<double>& r_x, std::vector<double>& r_l) const {
  for_each_contact_entry([&](std::size_t i, int e, double weights, int row, int column) {
    r_x[row] += weights * contacts_[i].whole[transposed ? 3 * (e % 3) + e / 3 : e] * x[column];
  });
  const double *H = H_.data(), *J = J_.data();
  for (int i = 0; i < scene_.dofs(); ++i)
    if (unknown_[i] >= 0) r_x[i] += mu_ * metric_[i] * x[i];
  for (std::size_t i = 0; i < idle_.size(); ++i) {
    const int dof = scene_.first_dof[scene_.directors[i].node];
    if (unknown_[dof] < 0) continue;
    for (int e = 0; e < 9; ++e) r_x[dof + e / 3] += idle_stiffness_[i] * idle_[i][e] * x[dof + e % 3];
  }
  double local[largest_kind.dofs], push[largest_kind.dofs];
  for_each_constraint(scene_, [&](const Group& group, int item) {
    const auto nodes = group.nodes(item);
    const int row = group.first_row + item * group.rows, dofs = 3 * group.arity;
    gather(scene_, group, item, x.data(), local);
    transpose_times(group.rows, dofs, J, &lambda[row], push);
    for (int a = 0; a < dofs; ++a, H += dofs) {
      const int dof = scene_.first_dof[nodes[a / 3]] + a % 3;
      if (unknown_[dof] < 0) continue;
      for (int b = 0; b < dofs; ++b) push[a] += H[b] * local[b];
      r_x[dof] -= push[a];
    }
    for (int j = 0; j < group.rows; ++j, J += dofs) {
      double sum = alpha_[group.first + item] * lambda[row + j];
      for (int d = 0; d < dofs; ++d) sum += J[d] * local[d];
      r_l[row + j] -= sum;
    }
  });
  for (const std::array<int, 3>& nodes : pressed_)
    for (int a = 0; a < 9; ++a, H += 9) {
      const int dof = scene_.first_dof[nodes[a / 3]] + a % 3;
      if (unknown_[dof] < 0) continue;
      for (int b = 0; b < 9; ++b) r_x[dof] -= H[b] * x[scene_.first_dof[nodes[b / 3]] + b % 3];
    }
  for_each_border([&](int v, std::size_t i, int dof) {
    if (unknown_[dof] >= 0) r_x[dof] -= border_[v][i] * lambda[scene_.rows + v];
    r_l[scene_.rows + v] -= border_[v][i] * x[dof];
  });
  for (std::size_t v = 0; v < border_.size(); ++v)
    r_l[scene_.rows + v] -= alpha_[scene_.constraints + v] * lambda[scene_.rows + v];
}

bool Kkt::solve(double* x, double* lambda, double accuracy, bool transposed) const {
  std::vector<double> r_x(x, x + scene_.dofs()), r_l(lambda, lambda + scene_.multipliers()), dx(r_x.size()),
      dl(r_l.size());
  std::vector<double> z_x(r_x.size(), 0.0), z_l(r_l.size(), 0.0);
  for (int i = 0; i < scene_.dofs(); ++i)
    if (unknown_[i] < 0) r_x[i] = 0.0;
  // Either part of a solution may vanish; corrections to it count relative to what such a right-hand side moves as a rule.
  std::vector<double> gradient(r_l.size(), largest(J_));
  for (std::size_t v = 0; v < border_.size(); ++v) gradient[scene_.rows + v] = largest(border_[v]);
  double move = ratio(largest(r_x), geometric_);
  for (std::size_t i = 0; i < r_l.size(); ++i) move = std::max(move, ratio(std::abs(r_l[i]), gradient[i]));
  const auto push = [&](const std::vector<double>& multipliers) {
    double force = 0.0;
    for (std::size_t i = 0; i < gradient.size(); ++i) force = std::max(force, gradient[i] * std::abs(multipliers[i]));
    return force;
  };
  double change = 1.0;
  for (int pass = 0; pass < 20; ++pass) {
    condensed_solve(r_x, r_l, transposed, dx, dl);
    for (std::size_t i = 0; i < dx.size(); ++i) z_x[i] += dx[i];
    for (std::size_t i = 0; i < dl.size(); ++i) z_l[i] += dl[i];
    const double before = std::exchange(change, std::max(ratio(largest(dx), std::max(largest(z_x), move)),
                                                         ratio(push(dl), std::max(push(z_l), geometric_ * move))));
    if (!std::isfinite(change)) return false;
    if (change <= accuracy || (pass > 0 && change > 0.5 * before)) break;
    subtract_product(dx, dl, transposed, r_x, r_l);
  }
  std::copy(z_x.begin(), z_x.end(), x);
  std::copy(z_l.begin(), z_l.end(), lambda);
  return change < 1e-6;
}

}  // namespace sheetbend
