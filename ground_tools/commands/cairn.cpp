// cairn: the ground tools of Cairn, one program with sub-commands.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "base/tool_error.hpp"
#include "commands/commands.hpp"
#include "detect/mpi_ranks.hpp"

int main(int argc, char** argv) {
  CLI::App app(
      "Cairn: localises a rover by the boulders around it. Maps are prepared here, drives simulated and "
      "replayed.",
      "cairn");
  app.set_version_flag("--version", "cairn 0.1.0");
  app.require_subcommand(1);
  cairn::ground::add_map_commands(app);
  cairn::ground::add_fix_command(app);
  cairn::ground::add_run_command(app);
  cairn::ground::add_rig_command(app);
  cairn::ground::add_mask_command(app);
  cairn::ground::add_sim_command(app);
  cairn::ground::add_table_command(app);
  cairn::ground::add_report_command(app);
  cairn::ground::add_campaign_command(app);
  cairn::ground::add_tape_command(app);
  cairn::ground::add_bench_command(app);
  cairn::ground::add_profile_command(app);
  cairn::ground::add_profile_diff_command(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // --help, --version
    return cairn::ground::MpiRanks::is_follower() ? 0 : app.exit(asked);
  } catch (const CLI::RuntimeError& answer) {  // a command worked, and its answer is not yes
    return answer.get_exit_code();
  } catch (const CLI::ParseError& error) {
    // All ranks have the same command line, and so come here. Rank 0 says it for all, and none ends before:
    // mpirun ends the others with the first that fails.
    const cairn::ground::MpiRanks ranks;
    if (ranks.rank() == 0) fmt::print(stderr, "cairn: {} (see cairn --help)\n", error.what());
    ranks.meet();
    return 1;
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "cairn: not enough memory for this input; give a smaller one\n");
    return 1;
  } catch (const std::exception& error) {  // ToolError, and what the standard library throws
    fmt::print(stderr, "cairn: {}\n", error.what());
    return 1;
  }
  return 0;
}
