// The partial state of a build: what was added is there again, and whatever the moment the process died at,
// the file that it left is of use.
#include "detect/partial_state.hpp"

#include "base/output_file.hpp"
#include "ground_tools/scratch.hpp"

using namespace cairn;
using namespace cairn::ground;
using Found = PartialState::Found;

namespace {

const test::Scratch scratch;
std::filesystem::path path;

Bytes content(unsigned i) { return Bytes(10 * i, static_cast<std::uint8_t>(i)); }

void write_three(const char* name) {
  path = scratch.path(name);
  std::filesystem::remove(path);
  PartialState state(path, "build A");
  assert_int_equal(static_cast<int>(state.found()), static_cast<int>(Found::kNothing));
  for (unsigned i = 0; i < 3; ++i) state.add(4, i, content(i));
}

void test_goes_on(void**) {
  write_three("on.part");
  {
    PartialState state(path, "build A");
    assert_int_equal(static_cast<int>(state.found()), static_cast<int>(Found::kSameBuild));
    assert_int_equal(state.records(), 3);
    for (unsigned i = 0; i < 3; ++i) assert_true(state.has(4, i) && state.get(4, i) == content(i));
    assert_false(state.has(4, 3));
    assert_false(state.has(3, 0));
    state.add(3, 7, content(9));
    assert_true(state.get(3, 7) == content(9));
    assert_true(state.get(4, 2) == content(2));
  }
  PartialState state(path, "build A");
  assert_int_equal(state.records(), 4);
  state.remove();
  assert_false(std::filesystem::exists(path));
}

void test_another_build_starts_over(void**) {
  write_three("other.part");
  PartialState state(path, "build B");
  assert_int_equal(static_cast<int>(state.found()), static_cast<int>(Found::kOtherBuild));
  assert_int_equal(state.records(), 0);
  state.add(4, 1, content(5));
  assert_true(state.get(4, 1) == content(5));
}

/// Killed after any byte, or a byte of it flipped: the records before it stay.
void test_torn_anywhere(void**) {
  write_three("whole.part");
  static std::vector<std::uint8_t> whole;
  whole = read_file(path);
  path = scratch.path("torn.part");
  std::size_t seen[4] = {};
  for (std::size_t cut = 0; cut < 2 * whole.size(); ++cut) {
    static std::vector<std::uint8_t> bytes;
    bytes = whole;
    const bool flip = cut >= whole.size();
    if (flip)
      bytes[cut - whole.size()] ^= 0x10;
    else
      bytes.resize(cut);
    write_file(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    const bool magic_gone = flip ? cut - whole.size() < 11 : cut > 0 && cut < 11;
    if (magic_gone) {  // no file of ours, as far as can be told: it is left alone
      assert_refused(PartialState(path, "build A"), "torn.part");
      continue;
    }
    PartialState state(path, "build A");
    ++seen[state.records()];
    for (unsigned i = 0; i < state.records(); ++i) assert_true(state.get(4, i) == content(i));
    state.add(4, 9, content(7));  // goes on behind what is whole
    assert_true(state.get(4, 9) == content(7));
  }
  assert_true(seen[0] > 0 && seen[1] > 0 && seen[2] > 0 && seen[3] == 0);
}

void test_in_memory(void**) {
  PartialState state({}, "build A");
  state.add(1, 2, content(3));
  assert_true(state.in_memory() && state.has(1, 2) && state.get(1, 2) == content(3));
}

void test_refusals(void**) {
  assert_refused(PartialState(scratch.path("x").parent_path() / "no" / "state.part", "A"),
                 "cannot write here");
  assert_refused(PartialState(scratch.file("letter.txt", "Dear reader, I am no state."), "A"),
                 "is not a partial state");
  assert_int_equal(read_file(scratch.path("letter.txt")).size(), 27);
  write_three("twice.part");
  PartialState first(path, "build A");
  assert_refused(PartialState(path, "build A"), "another run");
  if (std::filesystem::exists("/dev/full")) assert_refused(PartialState("/dev/full", "A"), "/dev/full");
}

void test_leaves_nothing_empty(void**) {
  path = scratch.path("empty.part");
  { PartialState state(path, "build A"); }
  assert_false(std::filesystem::exists(path));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_goes_on),       cmocka_unit_test(test_another_build_starts_over),
      cmocka_unit_test(test_torn_anywhere), cmocka_unit_test(test_in_memory),
      cmocka_unit_test(test_refusals),      cmocka_unit_test(test_leaves_nothing_empty),
  };
  return cmocka_run_group_tests_name("ground_tools/detect/partial_state", tests, nullptr, nullptr);
}
