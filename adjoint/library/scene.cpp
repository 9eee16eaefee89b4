#include <sheetbend/scene.h>

#include <algorithm>

#include "adjoint/library/model.h"
#include "adjoint/library/scene_file.h"

namespace sheetbend::v0 {
namespace {

// Of records with a name.
template <class Records>
std::size_t place_of(const Records& records, std::string_view name, const char* field, const char* what) {
  const auto at = std::ranges::find_if(records, [&](const auto& r) { return r.name == name; });
  if (at != records.end()) return static_cast<std::size_t>(at - records.begin());
  std::string known;
  for (const auto& r : records) known += (known.empty() ? "" : ", ") + std::string(r.name);
  throw InputError(field, "'" + std::string(name) + "' is no " + what + " of the scene", "use one of: " + known);
}

}  // namespace

Scene::Scene(std::shared_ptr<const Model> model) : model_(std::move(model)) {}

Scene Scene::load(const std::filesystem::path& path) {
  return Scene(std::make_shared<const Model>(library::read_scene_file(path)));
}

const std::string& Scene::name() const { return model_->name; }
std::size_t Scene::particles() const { return static_cast<std::size_t>(model_->particles); }
std::size_t Scene::nodes() const { return static_cast<std::size_t>(model_->topology.nodes()); }
std::size_t Scene::inputs() const { return model_->topology.layout.total(); }
std::span<const Quantity> Scene::quantities() const { return model_->quantities; }
std::span<const Group> Scene::groups() const { return model_->groups; }
std::span<const Array> Scene::arrays() const { return model_->arrays; }
std::span<const int> Scene::driven() const { return model_->topology.driven; }

std::size_t Scene::quantity(std::string_view name) const {
  return place_of(model_->quantities, name, "quantity", "quantity");
}

Array Scene::array(std::string_view name) const {
  return model_->arrays[place_of(model_->arrays, name, "array", "input array")];
}

std::vector<double> Scene::values(std::initializer_list<std::pair<std::string_view, double>> changes) const {
  std::vector<double> theta;
  for (const Quantity& q : model_->quantities) theta.push_back(q.value);
  for (const auto& [name, value] : changes) theta[quantity(name)] = value;
  return checked_values(*model_, theta);
}

std::vector<double> Scene::inputs_of(std::span<const double> values) const { return checked_inputs(*model_, values); }

}  // namespace sheetbend::v0
