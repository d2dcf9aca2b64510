// cairn: the ground tools of Cairn, one program with sub-commands.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "base/interrupts.hpp"
#include "base/tool_error.hpp"
#include "commands/commands.hpp"
#include "detect/mpi_ranks.hpp"

int main(int argc, char** argv) {
  cairn::ground::watch_interrupts();
  CLI::App app(
      "Cairn: localises a rover by the boulders around it. Maps are prepared here, drives simulated and "
      "replayed.",
      "cairn");
  app.set_version_flag("--version", "cairn 0.1.0");
  app.require_subcommand(1);
  const cairn::ground::Command program(app);
  cairn::ground::add_map_commands(program);
  cairn::ground::add_fix_command(program);
  cairn::ground::add_run_command(program);
  cairn::ground::add_rig_command(program);
  cairn::ground::add_mask_command(program);
  cairn::ground::add_sim_command(program);
  cairn::ground::add_table_command(program);
  cairn::ground::add_report_command(program);
  cairn::ground::add_campaign_command(program);
  cairn::ground::add_tape_command(program);
  cairn::ground::add_bench_command(program);
  cairn::ground::add_profile_command(program);
  cairn::ground::add_profile_diff_command(program);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // --help, --version
    return cairn::ground::MpiRanks::is_follower() ? 0 : app.exit(asked);
  } catch (const cairn::ground::Answer& answer) {
    return answer.status;
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
    const int interrupted = cairn::ground::interrupted_status();
    return interrupted != 0 ? interrupted : 1;
  }
  return 0;
}
