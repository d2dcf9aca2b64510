#include "quiet_gdal.hpp"

#include <cpl_conv.h>
#include <gdal_priv.h>

namespace cairn::ground {

QuietGdal::QuietGdal() {
  static const bool registered = (GDALAllRegister(), true);
  static_cast<void>(registered);
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

void CPL_STDCALL QuietGdal::remember(CPLErr severity, CPLErrorNum, const char* message) {
  auto* const self = static_cast<QuietGdal*>(CPLGetErrorHandlerUserData());
  if (severity < CE_Failure) return;
  self->failed_ = true;
  if (self->message_.empty()) self->message_ = message;
}

}  // namespace cairn::ground
