// Counts of enumerators.
#include "core/enum_count.hpp"

#include <cstdint>

#include "support/cmocka.hpp"

using namespace cairn;

namespace {

enum class One : std::uint8_t { kOnly };
enum class Numbered : std::uint8_t { kPart1, kPart2, kPart3 };
enum class Aliased : int { kFirst, kSecond, kLast = kSecond };

void test_one_more_or_less_is_seen(void**) {
  assert_true((enum_has<One, 1>()));
  assert_false((enum_has<One, 2>()));
  assert_true((enum_has<Numbered, 3>()));
  assert_false((enum_has<Numbered, 2>()));
  assert_false((enum_has<Numbered, 4>()));
  assert_true((enum_has<Aliased, 2>()));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {cmocka_unit_test(test_one_more_or_less_is_seen)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
