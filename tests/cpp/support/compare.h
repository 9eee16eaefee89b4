// Oracles and yardsticks: the complex step, the relative error of one vector against another, equality of
// bits.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "core/scalar/complex.h"
#include "core/scene/layout.h"

namespace sheetbend::testing {

inline constexpr double complex_step = 0x1p-133;  // a power of two, so that dividing by it is exact

// Deterministic random numbers: the same on every machine (std::uniform_real_distribution is not).
class Random {
 public:
  explicit Random(unsigned seed) : bits_(seed) {}
  double operator()(double low, double high) {
    return low + (high - low) * (static_cast<double>(bits_() >> 11) * 0x1p-53);
  }
  std::vector<double> vector(std::size_t n, double low = -1.0, double high = 1.0) {
    std::vector<double> v(n);
    for (double& a : v) a = (*this)(low, high);
    return v;
  }

 private:
  std::mt19937_64 bits_;
};

// d f(z + t v)/dt for f that maps vectors of Complex to vectors of Complex.
template <class F>
std::vector<double> complex_step_along(F&& f, const std::vector<double>& z, const std::vector<double>& v) {
  std::vector<Complex> probe(z.size());
  for (std::size_t i = 0; i < z.size(); ++i) probe[i] = {z[i], complex_step * v[i]};
  std::vector<double> out;
  for (const Complex& c : f(probe)) out.push_back(c.im / complex_step);
  return out;
}

// The gradient of f that maps vectors of Complex to a Complex.
template <class F>
std::vector<double> complex_step_gradient(F&& f, const std::vector<double>& z) {
  std::vector<Complex> probe(z.begin(), z.end());
  std::vector<double> g(z.size());
  for (std::size_t i = 0; i < z.size(); ++i) {
    probe[i].im = complex_step;
    g[i] = f(probe).im / complex_step;
    probe[i].im = 0.0;
  }
  return g;
}

// Sums of a gradient's entries with random signs, each over up to `width` neighbors of one part of it. An error of any entry shows in its
// sum, and an oracle by complex step needs one evaluation a sum.
class SignedSums {
 public:
  SignedSums(std::span<const std::size_t> part_sizes, std::size_t width) {
    Random random(7);
    for (const std::size_t size : part_sizes) {
      sums_of_part_.push_back((size + width - 1) / width);
      for (std::size_t i = 0; i < size; ++i) {
        if (i % width == 0) first_.push_back(sign_.size());
        sign_.push_back(random(-1.0, 1.0) < 0.0 ? -1.0 : 1.0);
      }
    }
    first_.push_back(sign_.size());
  }

  // How many sums each part has; they stand one part after the other.
  const std::vector<std::size_t>& sums_of_part() const { return sums_of_part_; }

  std::vector<double> of(std::span<const double> gradient) const {
    std::vector<double> sums(first_.size() - 1);
    for (std::size_t k = 0; k < sums.size(); ++k)
      for (std::size_t i = first_[k]; i < first_[k + 1]; ++i) sums[k] += sign_[i] * gradient[i];
    return sums;
  }

  // Those of the gradient of f, which maps vectors of Complex to a Complex.
  template <class F>
  std::vector<double> by_complex_step(F&& f, const std::vector<double>& z) const {
    std::vector<Complex> probe(z.begin(), z.end());
    std::vector<double> sums(first_.size() - 1);
    for (std::size_t k = 0; k < sums.size(); ++k) {
      for (std::size_t i = first_[k]; i < first_[k + 1]; ++i) probe[i].im = complex_step * sign_[i];
      sums[k] = f(probe).im / complex_step;
      for (std::size_t i = first_[k]; i < first_[k + 1]; ++i) probe[i].im = 0.0;
    }
    return sums;
  }

 private:
  std::vector<std::size_t> sums_of_part_, first_;  // first_ is per sum
  std::vector<double> sign_;                       // per entry
};

inline double largest(std::span<const double> a) {
  double m = 0.0;
  for (const double v : a) m = std::max(m, std::abs(v));
  return m;
}

// Quantities that scenes for direct blocks do not have.
inline bool is_of_volumes(int quantity) {
  return quantity == static_cast<int>(Quantity::volume) || quantity == static_cast<int>(Quantity::volume_compliance);
}

// Quantities that only scenes with contacts have.
inline bool is_of_contacts(int quantity) {
  constexpr Quantity all[]{Quantity::friction,       Quantity::contact_radius,     Quantity::contact_stiffness,
                           Quantity::collider_pose,  Quantity::collider_size,      Quantity::restitution,
                           Quantity::contact_weight, Quantity::contact_dissipation};
  return std::ranges::find(all, static_cast<Quantity>(quantity)) != std::end(all);
}

// max |a - b| / max |b|. Two zero vectors agree; anything against a zero vector, and NaN, does not.
inline double relative_error(std::span<const double> a, std::span<const double> b) {
  if (a.size() != b.size()) return std::numeric_limits<double>::infinity();
  double worst = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double e = std::abs(a[i] - b[i]);
    if (!(e <= worst)) worst = e;
    if (std::isnan(worst)) return std::numeric_limits<double>::infinity();
  }
  return worst == 0.0 ? 0.0 : worst / largest(b);
}

inline double dot(std::span<const double> a, std::span<const double> b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

// Leaves a measured error in the test's XML report.
inline void record_error(const std::string& what, double error) {
  ::testing::Test::RecordProperty(what, (std::ostringstream() << error).str());
}

// Compares what two gradients have of a quantity, which must matter.
inline void expect_quantity_agrees(const Layout& layout, Quantity quantity, std::span<const double> found,
                                   std::span<const double> oracle, double bound) {
  const char* name = quantity_names[static_cast<int>(quantity)];
  const auto part = [&](std::span<const double> g) { return g.subspan(layout.of(quantity), layout.count(quantity)); };
  EXPECT_GT(largest(part(oracle)), 0.0) << name << " does not matter in this scene";
  const double error = relative_error(part(found), part(oracle));
  EXPECT_LE(error, bound) << name;
  record_error(name, error);
}

// Compares two gradients quantity by quantity; every quantity that the scene has must matter, and only those of volumes and
// contacts may be missing.
inline void expect_gradients_agree(const Layout& layout, std::span<const double> found, std::span<const double> oracle,
                                   double bound) {
  ASSERT_EQ(found.size(), layout.total());
  ASSERT_EQ(oracle.size(), layout.total());
  for (int q = 0; q < quantity_count; ++q) {
    if (layout.size[q] == 0)
      EXPECT_TRUE(is_of_volumes(q) || is_of_contacts(q)) << quantity_names[q];
    else
      expect_quantity_agrees(layout, static_cast<Quantity>(q), found, oracle, bound);
  }
}

// Compares two sums of every quantity's entries, with random signs, with complex steps through `loss`, which maps inputs to a Complex. `bound` is relative
// to the quantity's largest entry.
template <class F>
void expect_sums_agree(const Layout& layout, F&& loss, const std::vector<double>& inputs, std::span<const double> found,
                       double bound) {
  for (int q = 0; q < quantity_count; ++q) {
    if (layout.size[q] == 0) continue;
    const std::size_t size = layout.size[q];
    const SignedSums sums({&size, 1}, (size + 1) / 2);
    const auto own = found.subspan(layout.offset[q], size);
    const std::vector<double> at(inputs.begin() + layout.offset[q], inputs.begin() + layout.offset[q + 1]);
    const auto of = [&](const std::vector<Complex>& part) {
      std::vector<Complex> probe(inputs.begin(), inputs.end());
      std::copy(part.begin(), part.end(), probe.begin() + layout.offset[q]);
      return loss(probe);
    };
    const auto mine = sums.of(own), expected = sums.by_complex_step(of, at);
    for (std::size_t k = 0; k < mine.size(); ++k)
      EXPECT_NEAR(mine[k], expected[k], bound * largest(own)) << quantity_names[q];
  }
}

template <class T>
::testing::AssertionResult same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  if (a.size() != b.size()) return ::testing::AssertionFailure() << a.size() << " numbers against " << b.size();
  for (std::size_t i = 0; i < a.size(); ++i)
    if (std::memcmp(&a[i], &b[i], sizeof(T)) != 0)
      return ::testing::AssertionFailure() << "bits first differ at number " << i;
  return ::testing::AssertionSuccess();
}

}  // namespace sheetbend::testing
