/// Pages in a browser without a window, where there is one.
#pragma once

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>

#include "base/output_file.hpp"
#include "ground_tools/scratch.hpp"
#include "support/cmocka.hpp"

namespace cairn::test {

/// The name of a browser that is installed; empty where there is none.
inline std::string browser() {
  for (const std::string name : {"chromium", "chromium-browser", "google-chrome"}) {
    if (std::system(("command -v " + name + " >/dev/null 2>&1").c_str()) == 0) return name;
  }
  return "";
}

/// Opens a page `width_px` wide and runs a script in it once the page is drawn: an expression, of what it
/// found out. What the script threw fails the test. The page's time is made up, and goes by as fast as the
/// page works; frames of the screen keep to a real clock, so that they are made of that time, too.
inline nlohmann::json ask_page(const Scratch& scratch, const std::string& page, const std::string& script,
                               int width_px, bool dark = false) {
  const std::string probe = "<p id=\"probe\"></p><script>setTimeout(() => { let out; try { out = " + script +
                            "; } catch (e) { out = {thrown: e.message}; } "
                            "document.getElementById('probe').textContent = JSON.stringify(out); }, 1500);"
                            "</script>\n</body>";
  std::string probed = page;
  probed.replace(probed.rfind("</body>"), 7, probe);
  probed.replace(probed.find("<body>"), 6,
                 "<body><script>requestAnimationFrame = (draw) => setTimeout(draw, 16);</script>");
  const std::string file = scratch.file("probed.html", probed).string();
  const std::string command = "timeout 120 " + browser() +
                              " --headless --no-sandbox --disable-gpu --virtual-time-budget=5000 --dump-dom" +
                              " --user-data-dir=" + scratch.path("browser").string() +
                              " --window-size=" + std::to_string(width_px) + ",900" +
                              (dark ? " --blink-settings=preferredColorScheme=0" : "") + " file://" + file +
                              " >" + scratch.path("dom").string() + " 2>/dev/null";
  if (std::system(command.c_str()) != 0) fail_msg("the browser failed: %s", command.c_str());
  const std::vector<std::uint8_t> bytes = ground::read_file(scratch.path("dom"));
  const std::string dom(bytes.begin(), bytes.end()), begin = "<p id=\"probe\">";
  const std::size_t from = dom.find(begin) + begin.size();
  const std::string said = dom.substr(from, dom.find("</p>", from) - from);
  static nlohmann::json out;
  out = nlohmann::json::parse(said, nullptr, false);
  if (out.is_discarded() || (out.is_object() && out.contains("thrown")))
    fail_msg("the page told '%s'", said.c_str());
  return out;
}

}  // namespace cairn::test
