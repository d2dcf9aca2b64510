// What killed runs leave beside an output goes when it is written again.
#include "base/output_file.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include "ground_tools/scratch.hpp"
#include "support/cmocka.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

const test::Scratch scratch;

void test_abandoned_parts_go(void**) {
  const pid_t dead = ::fork();
  if (dead == 0) ::_exit(0);
  assert_int_equal(::waitpid(dead, nullptr, 0), dead);
  const auto part = [](const std::string& of) { return scratch.file("out.csv.part" + of, "half"); };
  const std::filesystem::path abandoned = part(std::to_string(dead));
  const std::filesystem::path in_hand = part(std::to_string(::getppid()));
  const std::filesystem::path other = part("ial");
  write_file(scratch.path("out.csv"), "whole");
  assert_false(std::filesystem::exists(abandoned));
  assert_true(std::filesystem::exists(in_hand) && std::filesystem::exists(other));
  assert_int_equal(read_file(scratch.path("out.csv")).size(), 5);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {cmocka_unit_test(test_abandoned_parts_go)};
  return cmocka_run_group_tests_name("ground_tools/base/output_file", tests, nullptr, nullptr);
}
