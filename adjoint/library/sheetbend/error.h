/// @file
/// What the library throws.
#pragma once

#include <sheetbend/export.h>

#include <stdexcept>
#include <string>

namespace sheetbend::SHEETBEND_INLINE v0 {

/// Base of every error that the library throws on purpose.
class SHEETBEND_API Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// An input is wrong; thrown before any work starts. what() is "field: problem. Fix: what to do."
class SHEETBEND_API InputError : public Error {
 public:
  InputError(std::string field, std::string problem, std::string fix);

  const std::string& field() const { return field_; }      ///< the argument or the part of a file at fault
  const std::string& problem() const { return problem_; }  ///< what is wrong with it
  const std::string& fix() const { return fix_; }          ///< what to do about it

 private:
  std::string field_, problem_, fix_;
};

/// A motion left the finite numbers, or reached a state or a gradient that means nothing.
class SHEETBEND_API DivergenceError : public Error {
 public:
  DivergenceError(const std::string& what, int substep, double time, int particle)
      : Error(what), substep_(substep), time_(time), particle_(particle) {}

  int substep() const { return substep_; }    ///< after which it was seen
  double time() const { return time_; }       ///< [s]
  int particle() const { return particle_; }  ///< the first one at fault

 private:
  int substep_;
  double time_;
  int particle_;
};

/// Iterations ended without an answer: of conjugate gradients, of an implicit substep, of an equilibrium.
class SHEETBEND_API ConvergenceError : public Error {
 public:
  using Error::Error;
};

}  // namespace sheetbend::inline v0
