#include <sheetbend/stepper.h>

#include <algorithm>

#include "adjoint/library/model.h"
#include "core/rollout/rollout.h"

namespace sheetbend::v0 {
namespace {

constexpr std::string_view writable[]{"force", "gravity", "wind", "pressure"};

}  // namespace

struct Stepper::Parts {
  Scene scene;
  sheetbend::Scene topology;  // a copy: its driven particles may leave the scene's own motion
  Plan plan;
  std::vector<double> inputs;
  sheetbend::Rollout<double> rollout;

  Parts(const Scene& scene_, const Solver& solver, std::span<const double> values)
      : scene(scene_),
        topology(Model::of(scene)->topology),
        plan(plan_of(*Model::of(scene), solver)),
        inputs(checked_inputs(*Model::of(scene), values)),
        rollout(topology, plan, inputs.data()) {}

  std::size_t dofs() const { return static_cast<std::size_t>(topology.dofs()); }
};

Stepper::Stepper(const Scene& scene, const Solver& solver, std::span<const double> values)
    : parts_(translated([&] { return std::make_unique<Parts>(scene, solver, values); })) {}

Stepper::~Stepper() = default;
Stepper::Stepper(Stepper&&) noexcept = default;
Stepper& Stepper::operator=(Stepper&&) noexcept = default;

void Stepper::step() {
  translated([&] { parts_->rollout.advance(); });
}

void Stepper::step(std::span<const double> driven) {
  Parts& p = *parts_;
  check_size("driven", driven.size(), 3 * p.topology.driven.size());
  check_finite("driven", driven);
  // One knot holds at all times; its values are the first ones of the array.
  if (!driven.empty()) p.topology.boundary.times.resize(1);
  std::ranges::copy(
      driven, p.inputs.begin() + static_cast<std::ptrdiff_t>(p.topology.layout.of(sheetbend::Quantity::boundary)));
  step();
}

int Stepper::substep() const { return parts_->rollout.state().step; }
double Stepper::time() const { return parts_->rollout.time(substep()); }
std::span<const double> Stepper::positions() const { return {parts_->rollout.state().x, parts_->dofs()}; }
std::span<const double> Stepper::velocities() const { return {parts_->rollout.state().v, parts_->dofs()}; }

std::span<double> Stepper::input(std::string_view name) {
  const Array a = parts_->scene.array(name);
  if (std::ranges::find(writable, name) == std::end(writable))
    throw InputError("input", "'" + std::string(name) + "' cannot change between steps",
                     "change force, gravity, wind or pressure, or make another stepper");
  if (a.size == 0)
    throw InputError("input", "the scene has no " + std::string(name),
                     "make the scene with it, such as a force of zero");
  return std::span(parts_->inputs).subspan(a.offset, a.size);
}

void Stepper::save(State& state) const {
  const auto from = parts_->rollout.state();
  const std::size_t dofs = parts_->dofs();
  state.substep = from.step;
  state.positions.assign(from.x, from.x + dofs);
  state.positions_before.assign(from.x_before, from.x_before + dofs);
  state.velocities.assign(from.v, from.v + dofs);
  state.velocities_before.assign(from.v_before, from.v_before + dofs);
}

void Stepper::restore(const State& s) {
  if (s.substep < 0) throw InputError("state.substep", "is negative", "give a state that was saved");
  for (const auto* part : {&s.positions, &s.positions_before, &s.velocities, &s.velocities_before}) {
    check_size("state", part->size(), parts_->dofs());
    check_finite("state", *part);
  }
  parts_->rollout.restart(s.substep, {s.positions.data(), s.positions_before.data(), s.velocities.data(),
                                      s.velocities_before.data(), s.substep});
}

}  // namespace sheetbend::v0
