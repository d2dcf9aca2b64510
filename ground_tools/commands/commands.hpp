/// The sub-commands of `cairn`. Each file `cmd_<name>.cpp` adds its own to the command line.
#pragma once

#include <CLI/CLI.hpp>

namespace cairn::ground {

void add_map_commands(CLI::App& app);      ///< cairn map ...   (cmd_map.cpp)
void add_fix_command(CLI::App& app);       ///< cairn fix   (cmd_fix.cpp)
void add_run_command(CLI::App& app);       ///< cairn run ...   (cmd_run.cpp)
void add_rig_command(CLI::App& app);       ///< cairn rig   (cmd_rig.cpp)
void add_mask_command(CLI::App& app);      ///< cairn mask   (cmd_mask.cpp)
void add_sim_command(CLI::App& app);       ///< cairn sim   (cmd_sim.cpp)
void add_table_command(CLI::App& app);     ///< cairn table   (cmd_table.cpp)
void add_report_command(CLI::App& app);    ///< cairn report   (cmd_report.cpp)
void add_campaign_command(CLI::App& app);  ///< cairn campaign   (cmd_campaign.cpp)
void add_tape_command(CLI::App& app);      ///< cairn tape   (cmd_tape.cpp)
void add_bench_command(CLI::App& app);     ///< cairn bench   (cmd_bench.cpp)
void add_profile_command(CLI::App& app);   ///< cairn profile   (cmd_profile.cpp)
void add_profile_diff_command(CLI::App& app);

}  // namespace cairn::ground
