/// The files that a replay leaves (doc/guide/drives.md tells what is in each).
#pragma once

#include <deque>
#include <filesystem>
#include <string>

#include "base/output_file.hpp"
#include "replay/pictures.hpp"
#include "replay/summary.hpp"

namespace cairn::ground {

/// All results or none. The files are opened before the work, so that a folder that cannot be written is told
/// at once; a folder made for nothing goes again.
class Results {
 public:
  explicit Results(const std::filesystem::path& folder);
  ~Results();
  Results(const Results&) = delete;
  Results& operator=(const Results&) = delete;

  void write(const RunTitle& title, const Replay& replay, const RunErrors& errors,
             const PictureRecorder& pictures);
  /// For the user: `folder/{name,name,...}`.
  std::string names() const;

 private:
  std::filesystem::path folder_;
  bool made_;
  std::deque<OutputFile> files_;
};

}  // namespace cairn::ground
