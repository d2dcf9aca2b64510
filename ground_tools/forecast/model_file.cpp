#include "forecast/model_file.hpp"

#include <functional>
#include <string>

#include "base/json_file.hpp"
#include "base/tool_error.hpp"

namespace cairn::ground {
namespace {

using json = nlohmann::ordered_json;

struct Parameter {
  const char* name;
  double& value;
  double low;
  double high;
};

using Visit = std::function<void(const Parameter&)>;

void visit_detection(ForecastModel& m, const Visit& visit) {
  visit({"most", m.detection.most, 0.001, 1.0});
  visit({"half_m", m.detection.half_m, 0.005, 2.0});
  visit({"power", m.detection.power, 0.5, 20.0});
  visit({"spread", m.detection.spread, 0.0, 3.0});
}

void visit_others(ForecastModel& m, const Visit& visit) {
  visit({"clutter_per_m2", m.clutter_per_m2, 0.0, 100.0});
  visit({"sigma_pair_m", m.sigma_pair_m, 0.001, 1.0});
  visit({"sigma_common_m", m.sigma_common_m, 0.0, 1.0});
}

void take(const json& from, const std::function<void(const Visit&)>& parameters, const std::string& whose) {
  for (const auto& [key, value] : from.items()) {
    if (key == "detection" && value.is_object()) continue;
    bool known = false;
    parameters([&, name = key, number = value](const Parameter& p) {
      if (name != p.name) return;
      known = true;
      if (!number.is_number()) throw ToolError("{}: '{}' must be a number", whose, name);
      p.value = number.get<double>();
    });
    if (!known)
      throw ToolError("{}: unknown key '{}'; doc/guide/forecast.md has those there are", whose, key);
  }
}

}  // namespace

nlohmann::ordered_json model_json(const ForecastModel& model) {
  ForecastModel m = model;
  nlohmann::ordered_json out;
  visit_detection(m, [&](const Parameter& p) { out["detection"][p.name] = p.value; });
  visit_others(m, [&](const Parameter& p) { out[p.name] = p.value; });
  return out;
}

void read_model(const std::filesystem::path& path, ForecastModel& model) {
  const json from = read_json(path, "is not a model; give the forecast_model.json of a campaign");
  take(
      from, [&](const Visit& visit) { visit_others(model, visit); }, path.string());
  if (from.contains("detection") && from["detection"].is_object())
    take(
        from["detection"], [&](const Visit& visit) { visit_detection(model, visit); }, path.string());
  check_model(model, path.string());
}

void check_model(const ForecastModel& model, const std::string& whose) {
  ForecastModel m = model;
  const Visit check = [&](const Parameter& p) {
    check_range(fmt::format("{}: {}", whose, p.name), p.value, p.low, p.high);
  };
  visit_detection(m, check);
  visit_others(m, check);
}

}  // namespace cairn::ground
