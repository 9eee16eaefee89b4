#include "core/solver/swept_groups.h"

#include "core/contact/kernels.h"

namespace sheetbend {

std::vector<SweptContact> swept_contacts(const Scene& scene) {
  std::vector<SweptContact> contacts;
  for (int c = 0; c < static_cast<int>(scene.contacts.size()); ++c)
    for (int i = 0; i < scene.contacts[c].points(); ++i)
      if (const Contact& own = scene.contacts[c]; moves(scene, own, i))
        contacts.push_back({c, i, own.first_node(i), own.collider, scene.colliders[own.collider].any()});
  return contacts;
}

std::vector<SweptGroup> swept_groups(const Scene& scene, const std::vector<SweptContact>& contacts) {
  constexpr std::size_t lanes = sheetbend_contacts::lanes;
  std::vector<SweptGroup> groups;
  for (int i = 0; i < static_cast<int>(contacts.size()); ++i) {
    const SweptContact& own = contacts[i];
    const Contact& contact = scene.contacts[own.contact];
    if (groups.empty() || groups.back().contact != own.contact) groups.push_back({own.contact, i, 0});
    SweptGroup& group = groups.back();
    ++group.count;
    if (own.shape.grid || contact.restitution >= 0) continue;
    group.nodes.push_back(own.node);
    group.carries.push_back(contact.carried[own.item]);
  }
  for (SweptGroup& group : groups) {
    if (!group.packed()) continue;
    const std::size_t all = (group.nodes.size() + lanes - 1) / lanes * lanes;
    group.nodes.resize(all, group.nodes.back());
    group.carries.resize(all, group.carries.back());
  }
  return groups;
}

}  // namespace sheetbend
