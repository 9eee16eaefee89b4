#include "tests/cpp/support/cases.h"

namespace sheetbend::testing {

Case case_of(int kind) {
  Case row;
  with_kind(kind, [&]<class K>(K) { row = case_of<K>(); });
  return row;
}

std::string kind_name(int kind) {
  std::string name;
  with_kind(kind, [&]<class K>(K) { name = K::name; });
  return name;
}

}  // namespace sheetbend::testing
