/// Lines of a text file, by C's stdio: the targets have no streams.
#pragma once

#include <cstdio>
#include <string>

namespace cairn::test {

class TextFile {
 public:
  explicit TextFile(const std::string& path) : file_(std::fopen(path.c_str(), "r")) {}
  ~TextFile() {
    if (file_ != nullptr) std::fclose(file_);
  }
  TextFile(const TextFile&) = delete;
  TextFile& operator=(const TextFile&) = delete;

  /// The next line without its end; false where there is none.
  bool line(std::string& out) {
    out.clear();
    int c = file_ != nullptr ? std::fgetc(file_) : EOF;
    if (c == EOF) return false;
    for (; c != EOF && c != '\n'; c = std::fgetc(file_)) out.push_back(static_cast<char>(c));
    return true;
  }

 private:
  std::FILE* file_;
};

}  // namespace cairn::test
