// Steps a scene that has a knot of its driven motion and of its forces at every substep, with these numbers written
// from outside, and once more from a state on the way: stepping SCENE STEPS [own] [key=value...]. With `own` the
// scene's own motion and forces act.
#include <utility>

#include "shown.h"

int main(int count, char** arguments) {
  using namespace sheetbend;
  return shown([&] {
    const Scene scene = Scene::load(arguments[1]);
    const int steps = std::atoi(arguments[2]);
    const bool own = count > 3 && std::string(arguments[3]) == "own";
    Stepper stepper(scene, solver_of(count, arguments));
    const std::vector<double> inputs = scene.inputs_of();
    const auto knots = [&](const char* name, std::size_t columns, int n) {
      const Array a = scene.array(name);
      return std::span(inputs).subspan(a.offset + 3 * columns * static_cast<std::size_t>(n), 3 * columns);
    };
    const std::size_t driven = scene.driven().size(),
                      loaded = scene.array("force").size / 3 / (static_cast<std::size_t>(steps) + 1);
    const auto step = [&] {
      if (own) return stepper.step();
      const int next = stepper.substep() + 1;
      if (loaded > 0) {
        const auto force = stepper.input("force");
        const auto now = knots("force", loaded, next);
        for (std::size_t i = 0; i < force.size(); ++i) force[i] = now[i % now.size()];
      }
      stepper.step(knots("boundary", driven, next));
    };
    State middle;
    while (stepper.substep() < steps) {
      if (stepper.substep() == steps / 2) stepper.save(middle);
      step();
    }
    print("positions", stepper.positions());
    print("velocities", stepper.velocities());
    const double time = stepper.time();
    print("time", {&time, 1});
    stepper.restore(middle);
    while (stepper.substep() < steps) step();
    print("positions_again", stepper.positions());
    // Two branches from the middle; then on from the first step of the one, whose number the other one has too.
    State branch;
    stepper.restore(middle);
    step();
    stepper.save(branch);
    step();
    print("branch", stepper.positions());
    stepper.restore(middle);
    const double gravity = std::exchange(stepper.input("gravity")[2], 60.0);
    step();
    step();
    print("lifted", stepper.positions());
    stepper.restore(branch);
    stepper.input("gravity")[2] = gravity;
    step();
    print("branch_again", stepper.positions());
    stepper.save(middle);
    middle.velocities.pop_back();
    stepper.restore(middle);  // refused
  });
}
