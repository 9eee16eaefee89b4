// What stands behind the public types: a scene with the map from its quantities, and how the library's own errors
// become public ones.
#pragma once

#include <sheetbend/scene.h>
#include <sheetbend/solver.h>

#include "adjoint/equilibrium/equilibrium_tangents.h"
#include "adjoint/observe/experiment.h"
#include "adjoint/observe/parameter_map.h"
#include "adjoint/tape/tape_plan.h"
#include "core/solver/divergence.h"
#include "core/solver/implicit_block.h"

namespace sheetbend::v0 {

struct Model {
  std::string name;
  sheetbend::Scene topology;
  int particles = 0;  // the first of the nodes; the others are hidden
  ParameterMap map;
  std::vector<Quantity> quantities;
  std::vector<Group> groups = {};
  std::vector<Array> arrays = {};
  std::vector<double> least = {}, most = {};  // of each input, both ends allowed

  // Fills what follows from the rest, once it is complete.
  void complete();

  // What is behind a scene.
  static const std::shared_ptr<const Model>& of(const Scene& scene) { return scene.model_; }
};

// Of values that were checked, or the scene's own where there are none. Throws InputError.
std::vector<double> checked_values(const Model& model, std::span<const double> values);
std::vector<double> checked_inputs(const Model& model, std::span<const double> values);

// Throws InputError where the method cannot step the scene.
SolverOptions options_of(const Solver& solver);
Plan plan_of(const Model& model, const Solver& solver);

void check_size(const char* field, std::size_t got, std::size_t wanted);
void check_finite(const char* field, std::span<const double> numbers);

// "field: problem. Fix: what to do" as an error; the field in front where there is one.
InputError refusal(const std::string& message, const std::string& field = "");

// What the library's parts throw, as public errors.
template <class F>
decltype(auto) translated(F&& f) {
  try {
    return f();
  } catch (const Error&) {
    throw;
  } catch (const Diverged& e) {
    throw DivergenceError(e.what(), e.substep, e.time, e.node);
  } catch (const Unconverged& e) {
    throw ConvergenceError(e.what());
  } catch (const NoEquilibrium& e) {
    throw ConvergenceError(e.what());
  } catch (const BudgetTooSmall& e) {
    throw InputError("solver.memory", e.what(), "give more");
  } catch (const OutOfDomain& e) {
    throw refusal(e.what());
  } catch (const std::invalid_argument& e) {
    throw refusal(e.what());
  }
}

}  // namespace sheetbend::v0
