/// @file
/// Scenes: what is simulated, by named groups and named quantities.
#pragma once

#include <sheetbend/error.h>
#include <sheetbend/export.h>

#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace sheetbend::SHEETBEND_INLINE v0 {

struct Model;

/// A named physical number of a scene, such as "rope_EI".
struct Quantity {
  std::string name;
  double value;        ///< in `unit`, as the scene was made
  std::string unit;    ///< SI
  bool positive;       ///< whether only positive values make sense
  double scale;        ///< a natural size where zero is a sensible value (angles, offsets); 0 where there is none
  double least, most;  ///< the values that make sense lie between them
};

/// A named set of constraints of one kind.
struct Group {
  std::string name;
  std::string kind;  ///< such as "distance", "bend", "strain"
  int constraints;
};

/// Where an array stands in the flat vector of inputs, everything that a motion depends on: "position", "velocity",
/// "mass", "compliance", "damping", "rest", "boundary", "force", "gravity" and so on (docs/scene_file.md).
struct Array {
  std::string_view name;
  std::size_t offset, size;
};

/// A scene that is ready to be simulated. It cannot be changed; copies share it, and threads may use it at the same
/// time.
class SHEETBEND_API Scene {
 public:
  /// Reads the file that `sheetbend.save_scene` of the Python package writes (docs/scene_file.md). Every part of the
  /// file is checked, and no more memory is taken than in proportion to its size.
  /// @throws InputError  the file cannot be read, is damaged or of another version, or holds an inconsistent scene.
  static Scene load(const std::filesystem::path& path);

  const std::string& name() const;
  std::size_t particles() const;  ///< the first of the nodes
  /// How many rows arrays of positions have: the particles in order, and behind them the hidden nodes, such as the
  /// stub of a clamp, the frames of a rod or the axes of a body.
  std::size_t nodes() const;
  std::size_t inputs() const;  ///< the length of the flat vector of inputs

  std::span<const Quantity> quantities() const;  ///< in the order of values
  std::span<const Group> groups() const;
  std::span<const Array> arrays() const;

  /// The particles whose motion is given, in the order of the array "boundary".
  std::span<const int> driven() const;

  /// The place of a quantity in values. @throws InputError  there is none of that name.
  std::size_t quantity(std::string_view name) const;
  /// An input array. @throws InputError  there is none of that name.
  Array array(std::string_view name) const;

  /// The scene's values with some of them changed, one for each quantity.
  /// @throws InputError  an unknown name, or a value that makes no sense for its quantity.
  std::vector<double> values(std::initializer_list<std::pair<std::string_view, double>> changes = {}) const;

  /// The flat vector of inputs that values make; the scene's own where they are left out.
  /// @throws InputError  some are not finite, or negative where that makes no sense; names what is at fault.
  std::vector<double> inputs_of(std::span<const double> values = {}) const;

 private:
  friend struct Model;
  explicit Scene(std::shared_ptr<const Model> model);

  std::shared_ptr<const Model> model_;
};

}  // namespace sheetbend::inline v0
