// The mean height of a saved scene after one second, and its derivatives with respect to the scene's quantities.
#include <sheetbend/sheetbend.h>

#include <cstdio>
#include <vector>

int main(int count, char** arguments) {
  if (count != 2) {
    std::fprintf(stderr, "usage: %s SCENE\n", arguments[0]);
    return 2;
  }
  try {
    const auto scene = sheetbend::Scene::load(arguments[1]);
    std::vector<double> times;
    for (int frame = 0; frame <= 60; ++frame) times.push_back(frame / 60.0);
    const sheetbend::Rollout rollout(scene, times, {.h = 1.0 / 600.0});

    // The loss is the mean height of the last frame: its derivative with respect to every z is 1/particles.
    std::vector<double> positions_bar(rollout.positions().size());
    double height = 0.0;
    const std::size_t last = positions_bar.size() - 3 * scene.nodes();
    for (std::size_t i = last + 2; i < last + 3 * scene.particles(); i += 3) {
      positions_bar[i] = 1.0 / static_cast<double>(scene.particles());
      height += rollout.positions()[i] * positions_bar[i];
    }
    const sheetbend::Gradient gradient = rollout.gradient(positions_bar);

    std::printf("height %.17g\n", height);
    for (const auto& quantity : scene.quantities())
      std::printf("%s %.17g\n", quantity.name.c_str(), gradient.by(quantity.name));
  } catch (const sheetbend::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
