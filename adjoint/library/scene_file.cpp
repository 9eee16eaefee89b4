#include "adjoint/library/scene_file.h"

#include <algorithm>
#include <limits>
#include <set>

#include "adjoint/library/file_parts.h"
#include "adjoint/library/ranges.h"
#include "adjoint/library/validate.h"
#include "core/constraints/registry.h"

namespace sheetbend::library {
namespace {

using v0::InputError;
using v0::Model;

class SceneReader {
 public:
  explicit SceneReader(const std::filesystem::path& path) : file_(path), header_(file_.header()) {}

  Model model() {
    Model m;
    m.name = file_.name(header_, "name");
    m.quantities = quantities();
    try {
      m.topology = build_scene(topology());
    } catch (const std::invalid_argument& e) {
      const InputError error = v0::refusal(e.what());
      file_.fail(error.field(), error.problem(), error.fix());
    }
    m.particles = particles(m.topology.nodes());
    follow(m.topology);
    check_layout(m.topology.layout);
    m.map = map(m.topology.layout, m.quantities.size());
    check_base(m.topology.layout, m.map);
    if (const auto fault = fault_of(m.topology, m.map)) file_.fail(fault->field, fault->problem, fault->fix);
    m.complete();
    return m;
  }

 private:
  // The records of a list, with the words that name each.
  template <class F>
  void for_each_record(const char* key, F&& f) {
    const auto& list = file_.list(header_, key);
    for (std::size_t i = 0; i < list.size(); ++i) {
      const std::string where = std::string(key) + "[" + std::to_string(i) + "]";
      if (!list[i].is_object()) file_.fail(where, "is no object");
      f(list[i], std::to_string(i), where + ".");
    }
  }

  static bool given(const Json& record, const char* key) { return record.contains(key) && !record[key].is_null(); }

  std::vector<v0::Quantity> quantities() {
    constexpr double huge = std::numeric_limits<double>::max();
    std::vector<v0::Quantity> found;
    std::set<std::string> names;
    for_each_record("quantities", [&](const Json& q, const std::string&, const std::string& where) {
      v0::Quantity quantity{file_.name(q, "name", where),
                            file_.number(q, "value", where),
                            file_.name(q, "unit", where),
                            file_.flag(q, "positive", where),
                            0.0,
                            -huge,
                            huge};
      if (given(q, "scale")) quantity.scale = file_.number(q, "scale", where);
      if (given(q, "limits")) {
        const auto& limits = file_.list(q, "limits", where);
        if (limits.size() != 2) file_.fail(where + "limits", "must be two");
        const auto limit = [&](const Json& at, double open) {
          return at.is_null() ? open : file_.number(Json::object({{"limit", at}}), "limit", where);
        };
        quantity.least = limit(limits[0], -huge), quantity.most = limit(limits[1], huge);
      }
      if (quantity.positive) quantity.least = 0.0, quantity.most = huge;
      if (quantity.positive && !(quantity.value > 0.0)) file_.fail(where + "value", "must be positive");
      if (!names.insert(quantity.name).second) file_.fail(where + "name", "is there twice");
      found.push_back(std::move(quantity));
    });
    return found;
  }

  std::vector<std::array<int, 3>> triangles(const std::string& name, std::optional<long long> count = {}) {
    const std::vector<int> flat = file_.whole_numbers(name, 3, count);
    std::vector<std::array<int, 3>> found(flat.size() / 3);
    for (std::size_t i = 0; i < flat.size(); ++i) found[i / 3][i % 3] = flat[i];
    return found;
  }

  SceneSpec topology() {
    SceneSpec spec;
    const Json& layout = file_.object(header_, "layout");
    const auto& position = file_.list(layout, "position", "layout.");
    const long long size = position.size() == 2 && position[1].is_number_integer() ? position[1].get<long long>() : 0;
    base_ = file_.numbers("base");
    if (size <= 0 || size > static_cast<long long>(base_.size()) || size % 3 != 0 ||
        size > std::numeric_limits<int>::max())
      file_.fail("layout.position", "is no place");
    spec.particles = static_cast<int>(size / 3);
    const std::vector<int> directors = file_.whole_numbers("directors", 4);
    for (std::size_t i = 0; i < directors.size(); i += 4)
      spec.directors.push_back({directors[i], directors[i + 1], directors[i + 2], directors[i + 3]});
    if (file_.has("bodies")) {  // older files have none
      const std::vector<int> bodies = file_.whole_numbers("bodies", 5);
      for (std::size_t i = 0; i < bodies.size(); i += 5)
        spec.bodies.push_back({bodies[i], {bodies[i + 1], bodies[i + 2], bodies[i + 3]}, bodies[i + 4]});
    }
    spec.pinned = file_.whole_numbers("pinned");
    spec.driven = file_.whole_numbers("driven");
    for (const int n : spec.driven)  // the built scene only knows that it is driven
      if (std::ranges::find(spec.pinned, n) != spec.pinned.end())
        file_.fail("driven", "particle " + std::to_string(n) + " is pinned too", "either pin or drive a particle");
    spec.loaded = file_.whole_numbers("loaded");
    spec.has_drag = file_.flag(header_, "has_drag");
    spec.boundary = {file_.numbers("boundary_times"), interpolation(header_)};
    spec.force = {file_.numbers("force_times"), Interpolation::linear};
    spec.wind = {file_.numbers("wind_times"), Interpolation::linear};
    spec.air = triangles("air");
    if (file_.has("loads")) {
      const std::vector<int> loads = file_.whole_numbers("loads", 3);
      for (std::size_t i = 0; i < loads.size(); i += 3) spec.loads.push_back({loads[i], loads[i + 1], loads[i + 2]});
      spec.load = {file_.numbers("load_times"), Interpolation::linear};
    }
    std::set<std::string> names;
    for_each_record("groups", [&](const Json& g, const std::string& i, const std::string& where) {
      GroupSpec group{file_.name(g, "name", where), file_.name(g, "kind", where), file_.flag(g, "damped", where), {}};
      int arity = 0;
      with_kind(kind_of(group.kind), [&]<class K>(K) { arity = K::arity; });
      group.stencil = file_.whole_numbers("stencil_" + i, arity, file_.whole(g, "count", where));
      spec.groups.push_back(std::move(group));
    });
    for_each_record("volumes", [&](const Json& v, const std::string& i, const std::string& where) {
      const std::string name = file_.name(v, "name", where);
      if (!names.insert(name).second) file_.fail(where + "name", "is there twice");
      spec.volumes.push_back({name, triangles("volume_" + i, file_.whole(v, "triangles", where))});
    });
    if (header_.contains("contacts")) contacts(spec);  // older files have none
    return spec;
  }

  int particles(int nodes) {
    if (!header_.contains("particles")) return nodes;  // older files have no hidden nodes
    const long long count = file_.whole(header_, "particles");
    if (count < 0 || count > nodes) file_.fail("particles", "are not 0 to " + std::to_string(nodes));
    return static_cast<int>(count);
  }

  Interpolation interpolation(const Json& parent, const std::string& where = "") {
    const auto& how = file_.text(parent, "interpolation", where);
    if (how != "cubic" && how != "linear") file_.fail(where + "interpolation", "is unknown", "use 'cubic' or 'linear'");
    return how == "cubic" ? Interpolation::cubic : Interpolation::linear;
  }

  void contacts(SceneSpec& spec) {
    for_each_record("colliders", [&](const Json& c, const std::string& i, const std::string& where) {
      spec.colliders.push_back({file_.name(c, "name", where),
                                file_.text(c, "shape", where),
                                {file_.numbers("collider_times_" + i), interpolation(c, where)}});
    });
    for_each_record("contacts", [&](const Json& c, const std::string& i, const std::string& where) {
      ContactSpec contact{file_.name(c, "name", where),   -1, {}, {}, file_.flag(c, "rigid", where),
                          file_.flag(c, "bounces", where)};
      if (c.contains("dissipates")) contact.dissipates = file_.flag(c, "dissipates", where);
      if (c.contains("nodes")) contact.arity = static_cast<int>(file_.whole(c, "nodes", where));  // of points of bodies
      if (contact.arity < 1 || contact.arity > most_point_nodes)
        file_.fail(where + "nodes", "must lie in 1 to " + std::to_string(most_point_nodes));
      if (const long long own = file_.whole(c, "collider", where); own < static_cast<long long>(spec.colliders.size()))
        contact.collider = static_cast<int>(std::max(own, -1LL));
      const std::vector<int> rows = file_.whole_numbers("contact_" + i, contact.arity + 1);
      for (std::size_t k = 0; k < rows.size(); k += contact.arity + 1) {
        contact.nodes.insert(contact.nodes.end(), &rows[k], &rows[k] + contact.arity);
        contact.carried.push_back(rows[k + contact.arity]);
      }
      spec.contacts.push_back(std::move(contact));
    });
    if (header_.contains("collisions")) spec.balls = file_.whole_numbers("collisions");
  }

  // Driven particles that follow recorded markers: checked, and otherwise of no use here.
  void follow(const Scene& scene) {
    for_each_record("following", [&](const Json& f, const std::string& i, const std::string& where) {
      const auto& markers = file_.list(f, "markers", where);
      for (const Json& marker : markers)
        if (!file_.is_name(marker)) file_.fail(where + "markers", "are no names");
      file_.flag(f, "from_placed", where);
      const std::vector<int> slots = file_.whole_numbers("following_" + i);
      for (const int slot : slots)
        if (slot < 0 || slot >= static_cast<int>(scene.driven.size()))
          file_.fail("following_" + i, "names particles that are not driven");
      if (!markers.empty())
        file_.numbers("weights_" + i, static_cast<int>(markers.size()), static_cast<long long>(slots.size()));
    });
  }

  void check_layout(const Layout& layout) {
    const Json& given = header_["layout"];
    Json own = Json::object();
    for (int q = 0; q < quantity_count; ++q) {
      const bool newer = q >= oldest_quantity_count && layout.size[q] == 0;  // than the file, which then lacks it
      if (!newer || given.contains(quantity_names[q])) own[quantity_names[q]] = {layout.offset[q], layout.size[q]};
    }
    if (given != own) file_.fail("layout", "is not the one of this scene");
    if (base_.size() != layout.total()) file_.fail("base", "does not fit the scene's inputs");
  }

  ParameterMap map(const Layout& layout, std::size_t quantities) {
    ParameterTerms m;
    m.base = base_;
    m.target = file_.whole_numbers("target");
    const auto entries = static_cast<long long>(m.target.size());
    m.coefficient = file_.numbers("coefficient", 0, entries);
    m.first_factor = file_.whole_numbers("first_factor", 0, entries + 1);
    if (m.first_factor[0] != 0 || !std::ranges::is_sorted(m.first_factor))
      file_.fail("first_factor", "must start at 0 and not decrease");
    const long long factors = m.first_factor.back();
    m.parameter = file_.whole_numbers("parameter", 0, factors);
    const std::vector<int> function = file_.whole_numbers("function", 0, factors);
    m.weight = file_.numbers("weight", 0, factors);
    const auto within = [&](const char* name, const std::vector<int>& values, long long least, std::size_t limit) {
      for (const int v : values)
        if (v < least || v >= static_cast<long long>(limit))
          file_.fail(name, "must lie in " + std::to_string(least) + " to " +
                               std::to_string(static_cast<long long>(limit) - 1));
    };
    within("target", m.target, -entries, layout.total());
    within("parameter", m.parameter, -m.intermediates(), quantities);
    within("function", function, 0, factor_count);
    if (!m.in_order()) file_.fail("target", "makes an intermediate value after it is used, or leaves one out");
    for (const int f : function) m.function.push_back(static_cast<Factor1d>(f));
    return ParameterMap(std::move(m));
  }

  void check_base(const Layout& layout, const ParameterMap& map) {
    for (int q = 0; q < quantity_count; ++q) {
      const auto array = static_cast<Quantity>(q);
      const double *first = map.terms().base.data() + layout.offset[q], *last = first + layout.size[q];
      if (not_negative(array) && std::any_of(first, last, [](double v) { return v < 0.0; }))
        file_.fail(std::string("base.") + quantity_names[q], "must not be negative");
      const bool made = array == Quantity::volume || array == Quantity::volume_compliance ||
                        array == Quantity::friction || array == Quantity::contact_radius ||
                        array == Quantity::contact_stiffness || array == Quantity::collider_size ||
                        array == Quantity::restitution || array == Quantity::contact_weight ||
                        array == Quantity::contact_dissipation;
      if (made && std::any_of(first, last, [](double v) { return v != 0.0; }))
        file_.fail(std::string("base.") + quantity_names[q], "must be zero, quantities make it");
    }
  }

  FileParts file_;
  const Json& header_;
  std::vector<double> base_;
};

}  // namespace

v0::Model read_scene_file(const std::filesystem::path& path) { return SceneReader(path).model(); }

}  // namespace sheetbend::library
