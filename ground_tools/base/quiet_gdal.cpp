#include "base/quiet_gdal.hpp"

#include <cpl_conv.h>
#include <gdal_priv.h>

#include "base/tool_error.hpp"

namespace cairn::ground {

namespace {

/// GDAL would keep blocks of files in a twentieth of the machine's memory.
constexpr GIntBig kCacheBytes = 128 << 20;

bool prepare() {
  GDALAllRegister();
  if (CPLGetConfigOption("GDAL_CACHEMAX", nullptr) == nullptr) GDALSetCacheMax64(kCacheBytes);
  return true;
}

}  // namespace

QuietGdal::QuietGdal() {
  static const bool prepared = prepare();
  static_cast<void>(prepared);
  CPLPushErrorHandlerEx(&QuietGdal::remember, this);
  CPLSetThreadLocalConfigOption("GDAL_ERROR_ON_LIBJPEG_WARNING", "TRUE");
}

QuietGdal::~QuietGdal() {
  CPLSetThreadLocalConfigOption("GDAL_ERROR_ON_LIBJPEG_WARNING", nullptr);
  CPLPopErrorHandler();
}

std::string QuietGdal::reason() const {
  std::string line = message_.empty() ? std::string() : ": " + message_;
  for (char& c : line) {
    if (c == '\n' || c == '\r') c = ' ';
  }
  return line;
}

std::unique_ptr<GDALDataset> open_raster(const std::string& path, const char* what, const QuietGdal& gdal) {
  std::unique_ptr<GDALDataset> data(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY));
  if (data == nullptr || data->GetRasterCount() == 0)
    throw ToolError("{}: cannot be read as {}{}; check the name", path, what, gdal.reason());
  return data;
}

void CPL_STDCALL QuietGdal::remember(CPLErr severity, CPLErrorNum, const char* message) {
  auto* const self = static_cast<QuietGdal*>(CPLGetErrorHandlerUserData());
  if (severity < CE_Failure) return;
  self->failed_ = true;
  if (self->message_.empty()) self->message_ = message;
}

}  // namespace cairn::ground
