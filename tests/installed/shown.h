// What the programs of the tests have in common: bits of numbers on standard output, solvers from arguments, errors
// part by part.
#pragma once

#include <sheetbend/sheetbend.h>

#include <bit>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string>

inline void print(const std::string& name, std::span<const double> numbers) {
  std::printf("%s", name.c_str());
  for (const double x : numbers)
    std::printf(" %016llx", static_cast<unsigned long long>(std::bit_cast<std::uint64_t>(x)));
  std::printf("\n");
}

// Of arguments such as "method=implicit" and "threads=2"; others are left alone.
inline sheetbend::Solver solver_of(int count, char** arguments) {
  using namespace sheetbend;
  Solver solver{.h = 1.0 / 600.0};
  for (int i = 1; i < count; ++i) {
    const std::string argument = arguments[i], value = argument.substr(argument.find('=') + 1);
    const auto is = [&](const char* key) { return argument.starts_with(std::string(key) + "="); };
    if (is("h")) solver.h = std::atof(value.c_str());
    if (is("integrator")) solver.integrator = value == "bdf1" ? Integrator::bdf1 : Integrator::bdf2;
    if (is("method"))
      solver.method = value == "newton"         ? Method::newton
                      : value == "newton_cg"    ? Method::newton_cg
                      : value == "implicit"     ? Method::implicit
                      : value == "gauss_seidel" ? Method::gauss_seidel
                                                : Method::direct;
    if (is("iterations")) solver.iterations = std::atoi(value.c_str());
    if (is("threads")) solver.threads = std::atoi(value.c_str());
    if (is("grain")) solver.grain = std::atoi(value.c_str());
    if (is("force_tolerance")) solver.force_tolerance = std::atof(value.c_str());
    if (is("cg_tolerance")) solver.cg_tolerance = std::atof(value.c_str());
    if (is("cg_iterations")) solver.cg_iterations = std::atoi(value.c_str());
    if (is("memory")) solver.memory = std::strtoull(value.c_str(), nullptr, 10);
  }
  return solver;
}

// Runs a program; what the library throws is printed, and ends it with 3.
template <class F>
int shown(F&& program) {
  try {
    program();
    return 0;
  } catch (const sheetbend::InputError& e) {
    std::printf("input error: %s | %s | %s\n", e.field().c_str(), e.problem().c_str(), e.fix().c_str());
  } catch (const sheetbend::DivergenceError& e) {
    std::printf("divergence: %d | %.17g | %d | %s\n", e.substep(), e.time(), e.particle(), e.what());
  } catch (const sheetbend::ConvergenceError& e) {
    std::printf("convergence: %s\n", e.what());
  }
  return 3;
}
