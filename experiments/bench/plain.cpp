// The workloads as a plain loop over constraints, one at a time, without the package: a yardstick for its speed, and by complex step the
// source of its reference gradients.
//   plain WORKLOAD [REPEATS]                            seconds of each forward run after a warm-up, JSON
//   plain WORKLOAD --reference STRETCH BEND MASS        loss and four derivatives at these parameters, JSON
// WORKLOAD is W1, W1s or W2; what they are is told in sheetbend_bench/workloads.py.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <complex>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <map>
#include <string>
#include <vector>

namespace {

struct Workload {
  int rows, columns, frames, substeps, iterations;
  double stretch, bend, mass;
  int particles() const { return rows * columns; }
};

const std::map<std::string, Workload> workloads = {{"W1", {1, 100, 120, 10, 10, 1e-4, 1e-2, 0.1}},
                                                   {"W1s", {1, 100, 120, 20, 1, 1e-4, 1e-2, 0.1}},
                                                   {"W2", {64, 64, 60, 10, 5, 1e-3, 1e-2, 0.3}}};

struct Link {
  int a, b;
  bool bend;
  double rest;
};

bool is_pinned(const Workload& w, int particle) {
  if (w.rows == 1) return particle == 0;
  const int row = particle / w.columns, column = particle % w.columns;
  return (row == 0 || row == w.rows - 1) && (column == 0 || column == w.columns - 1);
}

std::vector<double> start(const Workload& w) {
  std::vector<double> x;
  for (int row = 0; row < w.rows; ++row)
    for (int column = 0; column < w.columns; ++column)
      x.insert(x.end(), {static_cast<double>(column) / (w.columns - 1), 0.0,
                         w.rows == 1 ? 0.0 : static_cast<double>(row) / (w.rows - 1)});
  return x;
}

std::vector<Link> links(const Workload& w) {
  struct Step {
    int down, right;
  };
  const std::vector<Step> rope = {{0, 1}, {0, 2}};
  const std::vector<Step> sheet = {{0, 1}, {1, 0}, {1, 1}, {1, -1}, {0, 2}, {2, 0}};
  const auto x = start(w);
  std::vector<Link> found;
  for (const Step s : w.rows == 1 ? rope : sheet)
    for (int color = 0; color < 2; ++color)
      for (int row = 0; row + s.down < w.rows; ++row)
        for (int column = std::max(0, -s.right); column + std::max(0, s.right) < w.columns; ++column) {
          if ((s.down > 0 ? row / s.down : column / s.right) % 2 != color) continue;
          const int a = row * w.columns + column, b = a + s.down * w.columns + s.right;
          const double along = x[3 * a] - x[3 * b], across = x[3 * a + 2] - x[3 * b + 2];
          const double length = std::sqrt(along * along + across * across);
          found.push_back({a, b, s.down == 2 || s.right == 2, length});
        }
  return found;
}

template <class T>
struct Parameters {
  T stretch, bend, mass;
};

// Calls visit(positions) after every frame.
template <class T, class Visit>
void simulate(const Workload& w, const std::vector<Link>& sweep, const Parameters<T>& p, std::vector<T> x,
              Visit&& visit) {
  using std::sqrt;
  const double h = 1.0 / 60.0 / w.substeps;
  const T light = T(w.particles()) / p.mass, a[2] = {p.stretch / (h * h), p.bend / (h * h)};
  std::vector<T> inverse_mass(w.particles()), v(x.size()), q(x.size()), lambda(sweep.size());
  for (int n = 0; n < w.particles(); ++n) inverse_mass[n] = is_pinned(w, n) ? T(0.0) : light;
  for (int step = 1; step <= w.frames * w.substeps; ++step) {
    for (int n = 0; n < w.particles(); ++n) {
      if (!is_pinned(w, n)) v[3 * n + 1] -= 9.81 * h;
      for (int d = 0; d < 3; ++d) q[3 * n + d] = x[3 * n + d] + h * v[3 * n + d];
    }
    std::fill(lambda.begin(), lambda.end(), T(0.0));
    for (int iteration = 0; iteration < w.iterations; ++iteration)
      for (std::size_t k = 0; k < sweep.size(); ++k) {
        const Link& link = sweep[k];
        T *one = &q[3 * link.a], *other = &q[3 * link.b];
        const T d[3] = {one[0] - other[0], one[1] - other[1], one[2] - other[2]};
        const T length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        const T w_one = inverse_mass[link.a], w_other = inverse_mass[link.b], soft = a[link.bend];
        const T change = (link.rest - length - soft * lambda[k]) / (w_one + w_other + soft);
        lambda[k] += change;
        const T push = change / length;
        for (int i = 0; i < 3; ++i) {
          one[i] += w_one * push * d[i];
          other[i] -= w_other * push * d[i];
        }
      }
    for (std::size_t i = 0; i < x.size(); ++i) {
      v[i] = (q[i] - x[i]) / h;
      x[i] = q[i];
    }
    if (step % w.substeps == 0) visit(x);
  }
}

std::vector<std::vector<double>> target(const Workload& w, const std::vector<Link>& sweep) {
  std::vector<std::vector<double>> frames;
  simulate<double>(w, sweep, {2.0 * w.stretch, 0.5 * w.bend, 1.2 * w.mass}, start(w),
                   [&](const std::vector<double>& x) { frames.push_back(x); });
  return frames;
}

template <class T>
T loss(const Workload& w, const std::vector<Link>& sweep, const Parameters<T>& p, const std::vector<T>& x0,
       const std::vector<std::vector<double>>& wanted) {
  T sum = 0.0;
  std::size_t frame = 0;
  simulate<T>(w, sweep, p, x0, [&](const std::vector<T>& x) {
    for (std::size_t i = 0; i < x.size(); ++i) {
      const T off = x[i] - wanted[frame][i];
      sum += 0.5 * off * off;
    }
    ++frame;
  });
  return sum;
}

void print_reference(const Workload& w, const Parameters<double>& p) {
  using Complex = std::complex<double>;
  constexpr double step = 1e-40;
  const auto sweep = links(w);
  const auto wanted = target(w, sweep);
  const auto x0 = start(w);
  const std::vector<Complex> still(x0.begin(), x0.end());
  std::vector<Complex> moved = still;
  for (std::size_t i = 0; i < moved.size(); ++i)
    if (!is_pinned(w, static_cast<int>(i / 3))) moved[i] += Complex(0.0, step * std::sin(1.0 + 0.7 * i));
  const Complex one(0.0, step);
  const Complex at_stretch = loss<Complex>(w, sweep, {p.stretch + one, p.bend, p.mass}, still, wanted);
  const Complex at_bend = loss<Complex>(w, sweep, {p.stretch, p.bend + one, p.mass}, still, wanted);
  const Complex at_mass = loss<Complex>(w, sweep, {p.stretch, p.bend, p.mass + one}, still, wanted);
  const Complex at_start = loss<Complex>(w, sweep, {p.stretch, p.bend, p.mass}, moved, wanted);
  std::printf("{\"loss\": %.17g, \"gradient\": [%.17g, %.17g, %.17g, %.17g]}\n", at_start.real(),
              at_stretch.imag() / step, at_bend.imag() / step, at_mass.imag() / step, at_start.imag() / step);
}

void print_times(const Workload& w, int repeats) {
  const auto sweep = links(w);
  const auto wanted = target(w, sweep);
  double value = 0.0;
  std::string seconds, processor;
  for (int run = 0; run <= repeats; ++run) {
    const auto begin = std::chrono::steady_clock::now();
    const std::clock_t busy = std::clock();
    value = loss<double>(w, sweep, {w.stretch, w.bend, w.mass}, start(w), wanted);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    if (run == 0) continue;
    const char* comma = run > 1 ? ", " : "";
    seconds += comma + std::to_string(took.count());
    processor += comma + std::to_string(static_cast<double>(std::clock() - busy) / CLOCKS_PER_SEC);
  }
  std::printf("{\"forward_s\": [%s], \"forward_cpu_s\": [%s], \"losses\": [%.17g]}\n", seconds.c_str(),
              processor.c_str(), value);
}

}  // namespace

int main(int count, char** arguments) {
  const std::vector<std::string> words(arguments + 1, arguments + count);
  const auto found = words.empty() ? workloads.end() : workloads.find(words[0]);
  if (found == workloads.end()) {
    std::fprintf(stderr, "usage: plain W1|W1s|W2 [REPEATS | --reference STRETCH BEND MASS]\n");
    return 2;
  }
  if (words.size() == 5 && words[1] == "--reference")
    print_reference(found->second, {std::stod(words[2]), std::stod(words[3]), std::stod(words[4])});
  else
    print_times(found->second, words.size() > 1 ? std::stoi(words[1]) : 5);
}
