/// How the networks of the shadow detector are fitted (detect/shadow_confidence.hpp), and written as source.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <numeric>
#include <string>
#include <vector>

#include "base/output_file.hpp"
#include "detect/shadow_confidence.hpp"
#include "sim/hash_random.hpp"

namespace cairn::test {

using namespace cairn::ground;

/// A fit, whatever is thought of it, and what the outputs of a network should be.
template <std::size_t kOutputs>
struct Example {
  ShadowWeights x;
  std::array<double, kOutputs> wanted;
};

/// As it is written.
inline double rounded(double x) { return std::stod(fmt::format("{:.4g}", x)); }

/// Adds the gradient of an example's loss, given that by the outputs.
template <std::size_t kOutputs, class Off>
void descend(const Example<kOutputs>& e, const ShadowNetwork<kOutputs>& network, const Off& off,
             ShadowNetwork<kOutputs>& gradient) {
  const ShadowHidden y = hidden_layer(e.x, network.hidden);
  const std::array<double, kOutputs> z = outputs(y, network);
  ShadowHidden inner{};
  for (std::size_t o = 0; o < kOutputs; ++o) {
    const double by_output = off(z[o], e.wanted[o]);
    gradient.out_0[o] += by_output;
    for (std::size_t k = 0; k < kShadowHidden; ++k) {
      gradient.out[o][k] += by_output * y[k];
      inner[k] += by_output * network.out[o][k];
    }
  }
  for (std::size_t k = 0; k < kShadowHidden; ++k) {
    const double rest = 1.0 - std::fabs(y[k]);
    inner[k] *= rest * rest;  // softsign's derivative, by its value
  }
  for (std::size_t i = 0; i < e.x.size(); ++i)
    for (std::size_t k = 0; k < kShadowHidden; ++k) gradient.hidden[i][k] += e.x[i] * inner[k];
}

/// Adam, with a pull to zero that keeps the many weights from chance.
template <std::size_t kOutputs, class Off>
ShadowNetwork<kOutputs> fitted(const std::vector<Example<kOutputs>>& set, int epochs, const Off& off) {
  constexpr std::size_t kBatch = 256;
  constexpr double kRate = 3e-3, kPull = 10.0;
  ShadowNetwork<kOutputs> network{}, gradient, mean{}, square{};
  constexpr std::size_t kWeights = sizeof(network) / sizeof(double);
  const auto flat = [](ShadowNetwork<kOutputs>& of) { return reinterpret_cast<double*>(&of); };
  sim::Draw draw(1, sim::Stream::kCampaign, 1);
  for (ShadowHidden& of : network.hidden)
    for (double& w : of) w = 0.2 * draw.uniform(-1.0, 1.0);
  for (ShadowHidden& of : network.out)
    for (double& w : of) w = 0.5 * draw.uniform(-1.0, 1.0);
  std::vector<std::size_t> order(set.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const std::size_t batches = set.size() / kBatch;
  double step = 0.0;
  for (int epoch = 0; epoch < epochs; ++epoch) {
    for (std::size_t i = order.size(); i-- > 1;)
      std::swap(order[i], order[std::min(i, static_cast<std::size_t>(draw.uniform() * (i + 1.0)))]);
    for (std::size_t batch = 0; batch < batches; ++batch) {
      gradient = {};
      for (std::size_t i = 0; i < kBatch; ++i)
        descend(set[order[batch * kBatch + i]], network, off, gradient);
      step += 1.0;
      const double rate = kRate * (1.0 - step / (epochs * static_cast<double>(batches)));
      const double fade = std::sqrt(1.0 - std::pow(0.999, step)) / (1.0 - std::pow(0.9, step));
      for (std::size_t i = 0; i < kWeights; ++i) {
        double& w = flat(network)[i];
        const double g = flat(gradient)[i] / kBatch + kPull / static_cast<double>(set.size()) * w;
        flat(mean)[i] += 0.1 * (g - flat(mean)[i]);
        flat(square)[i] += 0.001 * (g * g - flat(square)[i]);
        w -= rate * fade * flat(mean)[i] / (std::sqrt(flat(square)[i]) + 1e-8);
      }
    }
  }
  for (std::size_t i = 0; i < kWeights; ++i) flat(network)[i] = rounded(flat(network)[i]);
  return network;
}

template <class Numbers>
std::string text_of(const Numbers& numbers) {
  std::string text = "{";
  std::size_t column = 5;
  for (const double x : numbers) {
    const std::string word = fmt::format("{:.4g}, ", x);
    if (column + word.size() > 108) {
      text += "\n     ";
      column = 5;
    }
    text += word;
    column += word.size();
  }
  text.resize(text.size() - 2);
  return text + "}";
}

template <std::size_t kOutputs>
std::string text_of(const ShadowNetwork<kOutputs>& network) {
  std::string hidden, out;
  for (const ShadowHidden& of : network.hidden) hidden += (hidden.empty() ? "" : ",\n     ") + text_of(of);
  for (const ShadowHidden& of : network.out) out += (out.empty() ? "" : ",\n     ") + text_of(of);
  return fmt::format("{{{{{{{}}}}},\n     {{{{{}}}}},\n     {}}}", hidden, out, text_of(network.out_0));
}

/// Writes it as `made`, and tells whether `today` is the same to the byte.
inline bool is_source(const std::string& source, const std::filesystem::path& made,
                      const std::filesystem::path& today) {
  write_file(made, source);
  const std::vector<std::uint8_t> bytes = read_file(today);
  const bool same = std::string(bytes.begin(), bytes.end()) == source;
  fmt::print("\n{}: {}\n", today.string(), same ? "these numbers" : "other numbers");
  return same;
}

}  // namespace cairn::test
