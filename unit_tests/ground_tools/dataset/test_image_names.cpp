// Names as cameras and people give them: their order, and what tells left from right.
#include "dataset/image_names.hpp"

#include <algorithm>

#include "support/cmocka.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

using Names = std::vector<std::string>;

/// Each list is in order, whatever it was before.
void test_order(void**) {
  static const Names lists[] = {
      {"8", "9", "000010", "11"},
      {"frame_9", "frame_10", "frame_100"},
      {"a_10", "b_9"},
      {"0008", "0009", "000a", "000f", "0010"},
      {"9", "a1", "1ff", "200"},
      {"9.5", "10", "10.25", "10.5"},
      {"1403715273.25", "1403715273.5", "1403715274"},
      {"t1403715273.25", "t1403715273.5"},
      {"scene1.9", "scene1.10"},
      {"999999950000000", "1000000000000000", "1403715273262142976"},
      {"img_2_L", "img_10_L"},
      {"2011_09_26_9", "2011_09_26_10"},
      {"00", "0", "01", "1"},
  };
  for (const Names& list : lists) {
    static Names mixed;
    mixed.assign(list.rbegin(), list.rend());
    std::sort(mixed.begin(), mixed.end(), NameLess());
    const bool ties = list[0] == "00";
    for (std::size_t i = 0; i < list.size(); ++i) {
      if (mixed[i] != list[i] && !ties) fail_msg("%s before %s", mixed[i].c_str(), list[i].c_str());
      assert_false(NameLess()(list[i], list[i]));
    }
    if (ties) assert_true(mixed == Names({"0", "00", "01", "1"}));
  }
}

std::string bare(const char* name, const SideMark& mark, bool right = false) {
  return without_mark(name, mark, right).value_or("none");
}

void test_marks_stand_by_themselves(void**) {
  const SideMark word{"l", "r"}, left{"left", "right"}, camera{"cam0", "cam1"};
  assert_string_equal(bare("img_7_l", word).c_str(), "img_7_*");
  assert_string_equal(bare("l30", word).c_str(), "*30");
  assert_string_equal(bare("r30", word, true).c_str(), "*30");
  assert_string_equal(bare("img_7_r", word).c_str(), "none");
  assert_string_equal(bare("lunar", word).c_str(), "none");
  assert_string_equal(bare("model_l", word).c_str(), "model_*");
  assert_string_equal(bare("imgL_07", word).c_str(), "img*_07");
  assert_string_equal(bare("leftImg8bit_1", left).c_str(), "*Img8bit_1");
  assert_string_equal(bare("cleft_1", left).c_str(), "none");
  assert_string_equal(bare("LEFT_1", left).c_str(), "*_1");
  assert_string_equal(bare("Right_1", left, true).c_str(), "*_1");
  assert_string_equal(bare("cam0_5", camera).c_str(), "*_5");
  assert_string_equal(bare("cam05", camera).c_str(), "none");
  const SideMark last{"0", "1", SideMark::kLast}, second{"0", "1", 1};
  assert_string_equal(bare("1_155_0", last).c_str(), "1_155_*");
  assert_string_equal(bare("1_155_0", second).c_str(), "none");
  assert_string_equal(bare("1_0_155", second).c_str(), "1_*_155");
  assert_string_equal(bare("none", last).c_str(), "none");
}

void test_which_mark(void**) {
  const auto found = [](const Names& names) {
    const auto mark = find_side_mark(names, names);
    return mark ? std::string(mark->left) + " " + mark->right : "none";
  };
  assert_string_equal(found({"img_0_L", "img_0_R", "img_1_L", "img_1_R"}).c_str(), "l r");
  assert_string_equal(found({"left_0001", "right_0001", "left_0002"}).c_str(), "left right");
  assert_string_equal(found({"cam0_1", "cam1_1", "cam0_2", "cam1_2"}).c_str(), "cam0 cam1");
  assert_string_equal(found({"NLF_0001_7", "NRF_0001_7"}).c_str(), "nlf nrf");
  assert_string_equal(found({"0_0", "0_1", "1_0", "1_1", "2_0", "2_1"}).c_str(), "0 1");
  assert_string_equal(found({"camera1_7", "camera2_7", "camera1_8", "camera2_8"}).c_str(), "1 2");
  assert_string_equal(found({"0001", "0002", "0003", "0004"}).c_str(), "none");  // one camera's
  assert_string_equal(found({"img_1", "img_2", "img_3", "img_4"}).c_str(), "none");
  assert_string_equal(found({"img_0", "img_1", "img_2", "img_3", "img_4"}).c_str(), "none");
  assert_string_equal(found({}).c_str(), "none");
  const Names left{"7_left", "8_left"}, right{"7_right", "8_right"};
  assert_string_equal(find_side_mark(left, right)->right, "right");
  assert_false(find_side_mark(right, left).has_value());
  for (const char* name : {"Left", "LEFT", "left"}) {
    const auto pairs = pairs_by_mark({"calib", "imu", name, "Right", "depth_left"});
    assert_true(pairs.size() == 1 && pairs[0].first == name && pairs[0].second == "Right");
  }
}

void test_bare_numbers(void**) {
  assert_true(bare_numbers({"img_7_*", "img_10_*"}) == Names({"7", "10"}));
  assert_true(bare_numbers({"*_1403715273262142976", "*_1403715273312142976"}) ==
              Names({"1403715273262142976", "1403715273312142976"}));
  assert_true(bare_numbers({"t_1403715273.5", "t_1403715273.25"}) ==
              Names({"1403715273.5", "1403715273.25"}));
  assert_true(bare_numbers({"a_7", "b_7"}).empty());
  assert_true(bare_numbers({"a_7", "a_8_9"}).empty());
  assert_true(bare_numbers({"a", "b"}).empty());
  assert_true(bare_numbers({"img_7"}) == Names({"7"}));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_order),
      cmocka_unit_test(test_marks_stand_by_themselves),
      cmocka_unit_test(test_which_mark),
      cmocka_unit_test(test_bare_numbers),
  };
  return cmocka_run_group_tests_name("ground_tools/dataset/image_names", tests, nullptr, nullptr);
}
