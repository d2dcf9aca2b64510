/// GDAL without its chatter: what it complains about goes into our own one line.
#pragma once

#include <cpl_error.h>

#include <memory>
#include <string>

class GDALDataset;

namespace cairn::ground {

/// While it lives, nothing of GDAL reaches stderr on this thread, and the first failure is remembered.
/// Registers the drivers, and bounds GDAL's cache to 128 MiB unless GDAL_CACHEMAX is set. A JPEG that ends
/// early, to libjpeg a warning about an image filled up with grey, is a failure.
class QuietGdal {
 public:
  QuietGdal();
  ~QuietGdal();
  QuietGdal(const QuietGdal&) = delete;
  QuietGdal& operator=(const QuietGdal&) = delete;

  bool failed() const { return failed_; }
  /// Takes note of a call's result.
  void check(CPLErr result) { failed_ = failed_ || result != CE_None; }
  /// GDAL's words in one line, led by ": "; empty where it said nothing.
  std::string reason() const;

 private:
  static void CPL_STDCALL remember(CPLErr severity, CPLErrorNum number, const char* message);

  bool failed_ = false;
  std::string message_;
};

/// Opens a file with one band or more. Throws ToolError: cannot be read as `what`.
std::unique_ptr<GDALDataset> open_raster(const std::string& path, const char* what, const QuietGdal& gdal);

}  // namespace cairn::ground
