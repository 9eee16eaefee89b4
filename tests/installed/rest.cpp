// An equilibrium and its derivatives: rest SCENE
#include "shown.h"

int main(int, char** arguments) {
  using namespace sheetbend;
  return shown([&] {
    const Scene scene = Scene::load(arguments[1]);
    const Equilibrium first(scene), again(scene, scene.values(), first.positions());
    print("positions", first.positions());
    const double facts[]{first.energy(), static_cast<double>(first.unstable_modes()), again.energy()};
    print("facts", facts);
    print("quantities", first.gradient(first.positions()).quantities);
    print("tangent", first.tangent(scene.values()));
  });
}
