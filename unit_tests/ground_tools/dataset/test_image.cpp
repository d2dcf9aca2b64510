// Loading of images: depth, colour, and files that are damaged.
#include "dataset/image.hpp"

#include <fstream>
#include <iterator>

#include "ground_tools/scratch.hpp"
#include "ground_tools/test_images.hpp"

using namespace cairn;
using namespace cairn::ground;
using cairn::test::Scratch;

namespace {

const Scratch scratch;

/// The message of the ImageError; empty where the image loads.
std::string image_refusal(const std::filesystem::path& path) {
  try {
    static_cast<void>(load_grey(path));
  } catch (const ImageError& error) {
    return error.what();
  }
  return {};
}

void test_grey_is_exact(void**) {
  test::write_grey_png(scratch.path("grey.png"), 37, 21);
  static Image image;
  image = load_grey(scratch.path("grey.png"));
  assert_int_equal(image.width, 37);
  assert_int_equal(image.height, 21);
  for (int y = 0; y < 21; ++y) {
    for (int x = 0; x < 37; ++x) assert_int_equal(image.view().at(x, y), test::texture(x, y));
  }
}

void test_colour_becomes_luma(void**) {
  const int rgb[4][3] = {{255, 0, 0}, {0, 255, 0}, {0, 0, 255}, {255, 255, 255}};
  const auto sample = [&rgb](int b, int x, int) {
    return b == 3 ? 0 : rgb[x][b];
  };  // the alpha band says nothing
  const int luma[4] = {76, 150, 29, 255};
  for (const int bands : {3, 4}) {
    test::write_image(scratch.path("colour.png"), "PNG", GDT_Byte, 4, 2, bands, sample);
    static Image image;
    image = load_grey(scratch.path("colour.png"));
    for (int x = 0; x < 4; ++x) assert_int_equal(image.view().at(x, 1), luma[x]);
  }
}

void test_16_bit_is_scaled(void**) {
  const int deep[5] = {0, 128, 129, 257 * 100, 65535};
  const int grey[5] = {0, 0, 1, 100, 255};
  for (const char* driver : {"PNG", "GTiff"}) {
    static std::filesystem::path path;
    path = scratch.path(std::string("deep.") + driver);
    test::write_image(path, driver, GDT_UInt16, 5, 1, 1, [&deep](int, int x, int) { return deep[x]; });
    static Image image;
    image = load_grey(path);
    for (int x = 0; x < 5; ++x) assert_int_equal(image.view().at(x, 0), grey[x]);
  }
}

// A camera of 10 or 12 bits: the largest that these hold is white, what is beyond stays white.
void test_bits_that_are_used(void**) {
  const int deep[5] = {0, 2, 512, 1023, 4095};
  const auto path = scratch.path("ten.png");
  test::write_image(path, "PNG", GDT_UInt16, 5, 1, 1, [&deep](int, int x, int) { return deep[x]; });
  static Image image;
  const int at_10[5] = {0, 0, 128, 255, 255}, at_12[5] = {0, 0, 32, 64, 255};
  image = load_grey(path, 10);
  for (int x = 0; x < 5; ++x) assert_int_equal(image.view().at(x, 0), at_10[x]);
  image = load_grey(path, 12);
  for (int x = 0; x < 5; ++x) assert_int_equal(image.view().at(x, 0), at_12[x]);
  assert_int_equal(deep_samples(path).largest, 4095);
  assert_false(deep_samples(path).of_bytes);
  assert_true(image_size(path) == std::pair(5, 1));
  test::write_grey_png(scratch.path("eight.png"), 8, 8);
  assert_int_equal(deep_samples(scratch.path("eight.png")).largest, 0);
  for (const int factor : {257, 256, 255, 16}) {
    test::write_image(path, "PNG", GDT_UInt16, 5, 1, 1,
                      [factor](int, int x, int) { return factor * (50 + x); });
    assert_int_equal(deep_samples(path).of_bytes, factor > 255);
  }
}

// Drawing programs save a picture of two tones in one bit.
void test_fewer_bits_than_eight(void**) {
  for (const char* driver : {"PNG", "GTiff"}) {
    for (const int bits : {1, 2, 4}) {
      const int most = (1 << bits) - 1;
      static std::string option;
      option = "NBITS=" + std::to_string(bits);
      const char* const options[] = {option.c_str(), nullptr};
      const auto path = scratch.path("few." + std::to_string(bits) + driver);
      test::write_image(
          path, driver, GDT_Byte, 2, 1, 1, [most](int, int x, int) { return x * most; }, options);
      static Image image;
      image = load_grey(path);
      assert_int_equal(image.view().at(0, 0), 0);
      assert_int_equal(image.view().at(1, 0), 255);
    }
  }
}

void test_other_kinds_of_files(void**) {
  for (const char* driver : {"PNM", "BMP"}) {
    const auto path = scratch.path(std::string("kind.") + (driver[0] == 'P' ? "pgm" : "bmp"));
    test::write_image(path, driver, GDT_Byte, 37, 21, 1,
                      [](int, int x, int y) { return test::texture(x, y); });
    static Image image;
    image = load_grey(path);
    for (int x = 0; x < 37; ++x) assert_int_equal(image.view().at(x, 20), test::texture(x, 20));
  }
}

/// PGM and PPM whose samples are words, with remarks, and 10 bits deep.
void test_samples_in_words(void**) {
  static Image image;
  image = load_grey(scratch.file("p2.pgm", "P2\n# by hand\n3 2\n255\n0 1 2\n# a row\n253 254 255\n"));
  assert_true(image.width == 3 && image.height == 2);
  assert_true(image.pixels == std::vector<std::uint8_t>({0, 1, 2, 253, 254, 255}));
  assert_true(image_size(scratch.path("p2.pgm")) == std::pair(3, 2));
  image = load_grey(scratch.file("p3.ppm", "P3 2 1 255 255 0 0  0 0 255"));
  assert_true(image.pixels == std::vector<std::uint8_t>({76, 29}));
  image = load_grey(scratch.file("deep.pgm", "P2 2 1 1023 0 1023"), 10);
  assert_true(image.pixels == std::vector<std::uint8_t>({0, 255}));
  assert_int_equal(deep_samples(scratch.path("deep.pgm")).largest, 1023);
  for (const char* text : {"P2 3 2 255 0 1 2 253 254", "P2 3 1 255 0 1 256", "P2 3 1 255 0 1 x",
                           "P2 0 1 255 ", "P2 99999 99999 255 0", "P2", "P2 1 1 70000 0", "P2 1 1 255 -1"})
    assert_true(image_refusal(scratch.file("bad.pgm", text)).find("bad.pgm: not a readable") !=
                std::string::npos);
}

// Every kind of file, cut anywhere, is refused with one line that names it; what GDAL says is in it,
// not on stderr.
void test_truncated_files(void**) {
  for (const char* driver : {"JPEG", "PNG", "GTiff"}) {
    static std::filesystem::path whole, cut;
    whole = scratch.path(std::string("whole.") + driver);
    cut = scratch.path(std::string("cut.") + driver);
    test::write_image(whole, driver, GDT_Byte, 200, 150, 1,
                      [](int, int x, int y) { return test::texture(x, y); });
    assert_string_equal(image_refusal(whole).c_str(), "");
    static std::string bytes;
    std::ifstream in(whole, std::ios::binary);
    bytes.assign(std::istreambuf_iterator<char>(in), {});
    for (const double part : {0.0, 0.001, 0.02, 0.3, 0.7, 0.95}) {
      std::ofstream(cut, std::ios::binary)
          << bytes.substr(0, static_cast<std::size_t>(part * static_cast<double>(bytes.size())));
      static std::string message;
      message = image_refusal(cut);
      if (message.find(cut.string()) != 0 || message.find('\n') != std::string::npos) {
        fail_msg("%s cut at %g: '%s'", driver, part, message.c_str());
      }
    }
  }
}

void test_what_is_no_image(void**) {
  assert_true(image_refusal(scratch.path("absent.png")).find("absent.png: ") != std::string::npos);
  assert_true(image_refusal(scratch.file("text.jpg", "no image")).find("text.jpg: not a readable") !=
              std::string::npos);
  test::write_image(scratch.path("float.tif"), "GTiff", GDT_Float32, 4, 4, 1,
                    [](int, int x, int) { return x; });
  assert_true(image_refusal(scratch.path("float.tif")).find("not 8-bit or 16-bit") != std::string::npos);
  // After a refusal the next good image loads.
  test::write_grey_png(scratch.path("good.png"), 8, 8);
  assert_string_equal(image_refusal(scratch.path("good.png")).c_str(), "");
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_grey_is_exact),         cmocka_unit_test(test_colour_becomes_luma),
      cmocka_unit_test(test_16_bit_is_scaled),      cmocka_unit_test(test_truncated_files),
      cmocka_unit_test(test_fewer_bits_than_eight), cmocka_unit_test(test_bits_that_are_used),
      cmocka_unit_test(test_other_kinds_of_files),  cmocka_unit_test(test_what_is_no_image),
      cmocka_unit_test(test_samples_in_words),
  };
  return cmocka_run_group_tests_name("ground_tools/dataset/image", tests, nullptr, nullptr);
}
