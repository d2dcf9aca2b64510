// CRC-32 against the check value of its catalogue entry (ISO-HDLC), zlib's values and a bit by bit division.
#include "core/crc32.hpp"

#include "core/random.hpp"
#include "support/cmocka.hpp"

using namespace cairn;

namespace {

std::uint8_t bytes[1000];

std::uint32_t bit_by_bit(const std::uint8_t* data, std::size_t size) {
  std::uint32_t crc = 0xFFFFFFFFU;
  for (std::size_t i = 0; i < 8 * size; ++i) {
    const std::uint32_t bit = (data[i / 8] >> (i % 8)) & 1U;
    crc = ((crc ^ bit) & 1U) != 0U ? (crc >> 1U) ^ 0xEDB88320U : crc >> 1U;
  }
  return ~crc;
}

void test_known_values(void**) {
  const std::uint8_t check[] = {'1', '2', '3', '4', '5', '6', '7', '8', '9'};
  assert_int_equal(crc32(check, 9), 0xCBF43926U);
  assert_int_equal(crc32(check, 0), 0);
  for (int i = 0; i < 256; ++i) bytes[i] = static_cast<std::uint8_t>(i);
  assert_int_equal(crc32(bytes, 256), 0x29058C73U);  // zlib
  for (int i = 0; i < 32; ++i) bytes[i] = 0;
  assert_int_equal(crc32(bytes, 32), 0x190A55ADU);
  for (int i = 0; i < 32; ++i) bytes[i] = 0xFF;
  assert_int_equal(crc32(bytes, 32), 0xFF6CAB0BU);
}

void test_random_bytes_and_pieces(void**) {
  Random random(3);
  for (std::uint8_t& b : bytes) b = static_cast<std::uint8_t>(random.next());
  for (const std::size_t size : {1U, 2U, 3U, 7U, 64U, 999U})
    assert_int_equal(crc32(bytes, size), bit_by_bit(bytes, size));
  const std::uint32_t whole = crc32(bytes, sizeof bytes);
  for (const std::size_t cut : {0U, 1U, 500U, 999U, 1000U}) {
    assert_int_equal(crc32(bytes + cut, sizeof bytes - cut, crc32(bytes, cut)), whole);
  }
}

void test_one_flipped_bit_shows(void**) {
  const std::uint32_t whole = crc32(bytes, sizeof bytes);
  for (std::size_t i = 0; i < 8 * sizeof bytes; i += 37) {
    bytes[i / 8] = static_cast<std::uint8_t>(bytes[i / 8] ^ (1U << (i % 8)));
    assert_int_not_equal(crc32(bytes, sizeof bytes), whole);
    bytes[i / 8] = static_cast<std::uint8_t>(bytes[i / 8] ^ (1U << (i % 8)));
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_known_values),
      cmocka_unit_test(test_random_bytes_and_pieces),
      cmocka_unit_test(test_one_flipped_bit_shows),
  };
  return cmocka_run_group_tests_name("crc32", tests, nullptr, nullptr);
}
