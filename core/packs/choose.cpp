// The kernels of this machine.
#include <cstdlib>
#include <stdexcept>
#include <string>

#include "core/packs/contact_tables.h"
#include "core/packs/instruction_sets.h"
#include "core/packs/packed_colors.h"

#define SHEETBEND_DECLARE(variant)                                                       \
  extern "C" const sheetbend_packs::KernelTable* sheetbend_kernels_##variant() noexcept; \
  extern "C" const sheetbend_contacts::Table sheetbend_contacts_##variant;
SHEETBEND_DECLARE(portable)
#ifdef SHEETBEND_KERNELS_V3
SHEETBEND_DECLARE(v3)
#endif
#ifdef SHEETBEND_KERNELS_V4
SHEETBEND_DECLARE(v4)
#endif

namespace sheetbend {
namespace {

struct KernelSet {
  const sheetbend_packs::KernelTable* kernels;
  const sheetbend_contacts::Table* contacts;
};

// Those that this processor runs, widest first.
std::vector<KernelSet> available_sets() {
  std::vector<KernelSet> available;
#ifdef SHEETBEND_KERNELS_V4
  if (runs_v4()) available.push_back({sheetbend_kernels_v4(), &sheetbend_contacts_v4});
#endif
#ifdef SHEETBEND_KERNELS_V3
  if (runs_v3()) available.push_back({sheetbend_kernels_v3(), &sheetbend_contacts_v3});
#endif
  available.push_back({sheetbend_kernels_portable(), &sheetbend_contacts_portable});
  return available;
}

KernelSet choose() {
  const auto available = available_sets();
  const char* wanted = std::getenv("SHEETBEND_ISA");
  if (!wanted) return available.front();
  std::string names;
  for (const KernelSet& set : available) {
    if (std::string_view(wanted) == set.kernels->name) return set;
    names += (names.empty() ? "" : ", ") + std::string(set.kernels->name);
  }
  throw std::runtime_error("SHEETBEND_ISA: this machine or build has no kernels '" + std::string(wanted) +
                           "'. Fix: unset it, or use one of: " + names);
}

const KernelSet& chosen_set() {
  static const KernelSet chosen = choose();
  return chosen;
}

}  // namespace

std::vector<const sheetbend_packs::KernelTable*> available_kernels() {
  std::vector<const sheetbend_packs::KernelTable*> available;
  for (const KernelSet& set : available_sets()) available.push_back(set.kernels);
  return available;
}

const sheetbend_packs::KernelTable& pack_kernels() { return *chosen_set().kernels; }

const sheetbend_contacts::Table& contact_kernels() { return *chosen_set().contacts; }

const sheetbend_contacts::Table& contact_kernels_of(std::string_view instruction_set) {
  for (const KernelSet& set : available_sets())
    if (instruction_set == set.kernels->name) return *set.contacts;
  throw std::logic_error("no kernels of contacts for " + std::string(instruction_set));
}

std::vector<const char*> compiled_instruction_sets() {
  return {
#ifdef SHEETBEND_KERNELS_V4
      "x86-64-v4",
#endif
#ifdef SHEETBEND_KERNELS_V3
      "x86-64-v3",
#endif
      "portable"};
}

}  // namespace sheetbend
