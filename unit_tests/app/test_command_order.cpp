// Which command is new: each type by itself, over all the distance that numbers can have.
#include "app/command_order.hpp"

#include "support/cmocka.hpp"

using namespace cairn;
using namespace cairn::app;

namespace {

constexpr CommandType kOrdered[] = {
    CommandType::kSetStart,    CommandType::kSetTrim,   CommandType::kMotionPrior, CommandType::kLoadMap,
    CommandType::kBeginUpload, CommandType::kUseUpload, CommandType::kAttitude};
constexpr std::uint32_t kNumbers[] = {0, 1, 77, 0x7FFFFFFFU, 0x80000000U, 0xFFFFFFFEU, 0xFFFFFFFFU};

Command command(CommandType type, std::uint32_t sequence, std::uint32_t crc = 5) {
  Command c;
  c.type = type;
  c.sequence = sequence;
  c.crc = crc;
  return c;
}

void test_the_first_is_new_whatever_its_number(void**) {
  for (const CommandType type : kOrdered) {
    for (const std::uint32_t n : kNumbers)
      assert_status(CommandOrder().judge(command(type, n)), CommandStatus::kAccepted);
  }
}

void test_repeats(void**) {
  for (const CommandType type : kOrdered) {
    for (const std::uint32_t n : kNumbers) {
      CommandOrder order;
      order.accepted(command(type, n), 9);
      assert_status(order.judge(command(type, n)), CommandStatus::kRepeated);
      assert_int_equal(order.detail(type), 9);
      assert_int_equal(order.newest(type), n);
      assert_status(order.judge(command(type, n, 6)), CommandStatus::kContradicts);
    }
  }
}

/// Newer by 1 to half of all numbers; older by the other half.
void test_before_and_after(void**) {
  for (const std::uint32_t n : kNumbers) {
    CommandOrder order;
    order.accepted(command(CommandType::kSetStart, n), 0);
    const auto judge = [&](std::uint32_t ahead) {
      return order.judge(command(CommandType::kSetStart, n + ahead));
    };
    for (const std::uint32_t ahead : {1U, 2U, 1000U, 0x7FFFFFFFU})
      assert_status(judge(ahead), CommandStatus::kAccepted);
    for (const std::uint32_t ahead : {0x80000000U, 0x80000001U, 0xFFFFFFFEU, 0xFFFFFFFFU})
      assert_status(judge(ahead), CommandStatus::kStale);
  }
}

void test_judging_changes_nothing(void**) {
  CommandOrder order;
  order.accepted(command(CommandType::kSetTrim, 10), 3);
  for (int i = 0; i < 2; ++i) {
    assert_status(order.judge(command(CommandType::kSetTrim, 20)), CommandStatus::kAccepted);
    assert_status(order.judge(command(CommandType::kSetTrim, 10)), CommandStatus::kRepeated);
    assert_status(order.judge(command(CommandType::kSetTrim, 9)), CommandStatus::kStale);
  }
  order.accepted(command(CommandType::kSetTrim, 20, 8), 4);
  assert_status(order.judge(command(CommandType::kSetTrim, 10)), CommandStatus::kStale);
  assert_int_equal(order.newest(CommandType::kSetTrim), 20);
  assert_int_equal(order.detail(CommandType::kSetTrim), 4);
}

void test_types_do_not_share_numbers(void**) {
  CommandOrder order;
  for (const CommandType type : kOrdered) {
    assert_int_equal(order.newest(type), 0);
    assert_status(order.judge(command(type, 1)), CommandStatus::kAccepted);
    order.accepted(command(type, 100), 0);
  }
  for (const CommandType type : kOrdered) assert_status(order.judge(command(type, 1)), CommandStatus::kStale);
}

void test_chunks_and_requests_have_no_order(void**) {
  for (const CommandType type : {CommandType::kMapChunk, CommandType::kReportUpload}) {
    CommandOrder order;
    order.accepted(command(type, 100), 7);
    for (const std::uint32_t n : kNumbers)
      assert_status(order.judge(command(type, n)), CommandStatus::kAccepted);
    assert_status(order.judge(command(type, 100)), CommandStatus::kAccepted);
    assert_int_equal(order.newest(type), 0);
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_the_first_is_new_whatever_its_number),
      cmocka_unit_test(test_repeats),
      cmocka_unit_test(test_before_and_after),
      cmocka_unit_test(test_judging_changes_nothing),
      cmocka_unit_test(test_types_do_not_share_numbers),
      cmocka_unit_test(test_chunks_and_requests_have_no_order),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
