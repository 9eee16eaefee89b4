// A sheet of triangles with strain and bending as a plain loop over constraints, one at a time, without the package: a yardstick for its speed
// and, by complex step, a check of its gradient.
//   plain_cloth SHEET [REPEATS]            seconds of each forward run after a warm-up, and the sum of the last coordinates, JSON
//   plain_cloth SHEET --derivative         of that sum, along the sheet's direction, JSON
// SHEET is what plain_cloth.py writes: numbers, each with its share of the direction; constraints in the order of a sweep.
#include <cmath>
#include <complex>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using Complex = std::complex<double>;
constexpr double step = 1e-40;

template <class T>
struct Triangle {
  int nodes[3];
  T N1_u, N1_v, N2_u, N2_v, coupling, weft, shear, compliance;  // as the constraint `strain` has them
  T by_u, by_v;                                                 // what its second row has of both strains
};

template <class T>
struct Hinge {
  int nodes[4];
  T rest, compliance;
};

template <class T>
struct Sheet {
  int particles, substeps, sweeps;
  double h;
  std::vector<T> x, mass, gravity;
  std::vector<char> pinned;
  std::vector<Triangle<T>> triangles;
  std::vector<Hinge<T>> hinges;
};

void read(std::istream& in, double& to) {
  double along;
  in >> to >> along;
}

void read(std::istream& in, Complex& to) {
  double value, along;
  in >> value >> along;
  to = {value, step * along};
}

template <class T>
Sheet<T> read_sheet(const std::string& path) {
  std::ifstream in(path);
  Sheet<T> s;
  std::size_t triangles, hinges;
  in >> s.particles >> s.substeps >> s.sweeps >> s.h >> triangles >> hinges;
  s.x.resize(3 * s.particles), s.mass.resize(s.particles), s.gravity.resize(3), s.pinned.resize(s.particles);
  for (auto* numbers : {&s.x, &s.mass, &s.gravity})
    for (T& number : *numbers) read(in, number);
  for (char& p : s.pinned) in >> p, p -= '0';
  s.triangles.resize(triangles), s.hinges.resize(hinges);
  for (auto& t : s.triangles) {
    for (int& n : t.nodes) in >> n;
    for (T* p : {&t.N1_u, &t.N1_v, &t.N2_u, &t.N2_v, &t.coupling, &t.weft, &t.shear, &t.compliance}) read(in, *p);
  }
  for (auto& hinge : s.hinges) {
    for (int& n : hinge.nodes) in >> n;
    read(in, hinge.rest), read(in, hinge.compliance);
  }
  const T h2(s.h * s.h);
  for (auto& t : s.triangles) {
    const T scale = T(1.0) / std::sqrt(T(1.0) - t.coupling * t.coupling);
    t.by_u = t.coupling * scale, t.by_v = t.weft * scale, t.compliance /= h2;
  }
  for (auto& hinge : s.hinges) hinge.compliance /= h2;
  if (!in) throw std::runtime_error("plain_cloth: " + path + " is no sheet. Fix: write it with plain_cloth.py");
  return s;
}

template <class T>
struct Vector {
  T x, y, z;
  friend Vector operator+(const Vector& a, const Vector& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend Vector operator-(const Vector& a, const Vector& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend Vector operator*(const T& a, const Vector& b) { return {a * b.x, a * b.y, a * b.z}; }
};

template <class T>
T dot(const Vector<T>& a, const Vector<T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

template <class T>
Vector<T> cross(const Vector<T>& a, const Vector<T>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

double angle_of(double sine, double cosine) { return std::atan2(sine, cosine); }
Complex angle_of(const Complex& sine, const Complex& cosine) {  // the first order
  const double s = sine.real(), c = cosine.real();
  return {std::atan2(s, c), (c * sine.imag() - s * cosine.imag()) / (s * s + c * c)};
}

// Moves particles by w J^T dl, where dl solves (sum_k w_k J_k J_k^T + a) dl = -C - a lambda with the compliance a over h^2.
template <class T>
void project(const Triangle<T>& t, const std::vector<T>& w, Vector<T>* q, T* lambda) {
  const int i = t.nodes[0], j = t.nodes[1], k = t.nodes[2];
  const Vector<T> e1 = q[j] - q[i], e2 = q[k] - q[i];
  const Vector<T> u = t.N1_u * e1 + t.N2_u * e2, v = t.N1_v * e1 + t.N2_v * e2;
  const T E_u = T(0.5) * (dot(u, u) - T(1.0)), E_v = T(0.5) * (dot(v, v) - T(1.0));
  const T C[3] = {E_u, t.by_u * E_u + t.by_v * E_v, t.shear * dot(u, v)};
  Vector<T> J[3][3];  // of row and particle
  const T N_u[3] = {-t.N1_u - t.N2_u, t.N1_u, t.N2_u}, N_v[3] = {-t.N1_v - t.N2_v, t.N1_v, t.N2_v};
  for (int p = 0; p < 3; ++p) {
    J[0][p] = N_u[p] * u;
    J[1][p] = (t.by_u * N_u[p]) * u + (t.by_v * N_v[p]) * v;
    J[2][p] = (t.shear * N_u[p]) * v + (t.shear * N_v[p]) * u;
  }
  T A[3][3], b[3];
  for (int r = 0; r < 3; ++r) {
    b[r] = -C[r] - t.compliance * lambda[r];
    for (int c = 0; c <= r; ++c) {
      A[r][c] = r == c ? t.compliance : T(0.0);
      for (int p = 0; p < 3; ++p) A[r][c] += w[t.nodes[p]] * dot(J[r][p], J[c][p]);
    }
  }
  const T l10 = A[1][0] / A[0][0], l20 = A[2][0] / A[0][0];
  const T d1 = A[1][1] - l10 * A[1][0], e21 = A[2][1] - l20 * A[1][0], l21 = e21 / d1;
  const T d2 = A[2][2] - l20 * A[2][0] - l21 * e21;
  b[1] -= l10 * b[0], b[2] -= l20 * b[0] + l21 * b[1];
  b[2] = b[2] / d2, b[1] = b[1] / d1 - l21 * b[2], b[0] = b[0] / A[0][0] - l10 * b[1] - l20 * b[2];
  for (int r = 0; r < 3; ++r) lambda[r] += b[r];
  for (int p = 0; p < 3; ++p) {
    const int node = t.nodes[p];
    q[node] = q[node] + w[node] * (b[0] * J[0][p] + b[1] * J[1][p] + b[2] * J[2][p]);
  }
}

template <class T>
void project(const Hinge<T>& hinge, const std::vector<T>& w, Vector<T>* q, T& lambda) {
  const int* n = hinge.nodes;
  const Vector<T> e = q[n[1]] - q[n[0]], to_a = q[n[2]] - q[n[0]], to_b = q[n[3]] - q[n[0]];
  const Vector<T> normal_a = cross(e, to_a), normal_b = cross(to_b, e);
  const T length2 = dot(e, e), length = std::sqrt(length2);
  const T angle = angle_of(length * dot(normal_a, to_b), dot(normal_a, normal_b));
  const Vector<T> by_a = (length / dot(normal_a, normal_a)) * normal_a;
  const Vector<T> by_b = (length / dot(normal_b, normal_b)) * normal_b;
  const T foot_a = dot(to_a, e) / length2, foot_b = dot(to_b, e) / length2;
  const Vector<T> by_1 = T(-1.0) * (foot_a * by_a + foot_b * by_b), by_0 = T(-1.0) * (by_1 + by_a + by_b);
  const T sum = w[n[0]] * dot(by_0, by_0) + w[n[1]] * dot(by_1, by_1) + w[n[2]] * dot(by_a, by_a) +
                w[n[3]] * dot(by_b, by_b) + hinge.compliance;
  const T change = (hinge.rest - angle - hinge.compliance * lambda) / sum;
  lambda += change;
  q[n[0]] = q[n[0]] + (w[n[0]] * change) * by_0;
  q[n[1]] = q[n[1]] + (w[n[1]] * change) * by_1;
  q[n[2]] = q[n[2]] + (w[n[2]] * change) * by_a;
  q[n[3]] = q[n[3]] + (w[n[3]] * change) * by_b;
}

// The sum of the last coordinates.
template <class T>
T simulate(const Sheet<T>& s) {
  std::vector<Vector<T>> x(s.particles), q(s.particles), v(s.particles, {0.0, 0.0, 0.0});
  std::vector<T> w(s.particles), lambda(3 * s.triangles.size() + s.hinges.size());
  const Vector<T> gravity = {s.gravity[0], s.gravity[1], s.gravity[2]};
  for (int n = 0; n < s.particles; ++n) {
    x[n] = {s.x[3 * n], s.x[3 * n + 1], s.x[3 * n + 2]};
    w[n] = s.pinned[n] ? T(0.0) : T(1.0) / s.mass[n];
  }
  for (int substep = 0; substep < s.substeps; ++substep) {
    for (int n = 0; n < s.particles; ++n) q[n] = s.pinned[n] ? x[n] : x[n] + T(s.h) * (v[n] + T(s.h) * gravity);
    lambda.assign(lambda.size(), T(0.0));
    for (int sweep = 0; sweep < s.sweeps; ++sweep) {
      T* own = lambda.data();
      for (const auto& t : s.triangles) project(t, w, q.data(), own), own += 3;
      for (const auto& hinge : s.hinges) project(hinge, w, q.data(), *own++);
    }
    for (int n = 0; n < s.particles; ++n) {
      v[n] = T(1.0 / s.h) * (q[n] - x[n]);
      x[n] = q[n];
    }
  }
  T sum = 0.0;
  for (const auto& p : x) sum += p.x + p.y + p.z;
  return sum;
}

double processor_seconds() {
  timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return now.tv_sec + 1e-9 * now.tv_nsec;
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 2) {
    std::fprintf(stderr, "usage: plain_cloth SHEET [REPEATS | --derivative]\n");
    return 2;
  }
  if (count > 2 && std::string(arguments[2]) == "--derivative") {
    std::printf("{\"derivative\": %.17g}\n", simulate(read_sheet<Complex>(arguments[1])).imag() / step);
    return 0;
  }
  const auto sheet = read_sheet<double>(arguments[1]);
  const int repeats = count > 2 ? std::atoi(arguments[2]) : 5;
  double sum = simulate(sheet);
  std::printf("{\"forward_cpu_s\": [");
  for (int i = 0; i < repeats; ++i) {
    const double begin = processor_seconds();
    sum = simulate(sheet);
    std::printf("%s%.9g", i ? ", " : "", processor_seconds() - begin);
  }
  std::printf("], \"sum\": %.17g}\n", sum);
}
