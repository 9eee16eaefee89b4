// Steps a scene with its driven particles held, and does every step twice: loop SCENE STEPS [key=value...]
#include "shown.h"

int main(int count, char** arguments) {
  using namespace sheetbend;
  return shown([&] {
    const Scene scene = Scene::load(arguments[1]);
    Stepper stepper(scene, solver_of(count, arguments));
    std::vector<double> driven;
    for (const int n : scene.driven())
      for (std::size_t k = 0; k < 3; ++k) driven.push_back(stepper.positions()[3 * static_cast<std::size_t>(n) + k]);
    State state;
    for (int n = std::atoi(arguments[2]); n > 0; --n) {
      stepper.save(state);
      stepper.step(driven);
      stepper.restore(state);
      stepper.step(driven);
    }
    print("positions", stepper.positions());
  });
}
