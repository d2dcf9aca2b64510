/// The sub-commands of `cairn`. Each file `cmd_<name>.cpp` adds its own to the command line.
#pragma once

#include "commands/command_line.hpp"

namespace cairn::ground {

void add_map_commands(Command app);      ///< cairn map ...   (cmd_map.cpp)
void add_fix_command(Command app);       ///< cairn fix   (cmd_fix.cpp)
void add_run_command(Command app);       ///< cairn run ...   (cmd_run.cpp)
void add_rig_command(Command app);       ///< cairn rig   (cmd_rig.cpp)
void add_mask_command(Command app);      ///< cairn mask   (cmd_mask.cpp)
void add_sim_command(Command app);       ///< cairn sim   (cmd_sim.cpp)
void add_table_command(Command app);     ///< cairn table   (cmd_table.cpp)
void add_report_command(Command app);    ///< cairn report   (cmd_report.cpp)
void add_campaign_command(Command app);  ///< cairn campaign   (cmd_campaign.cpp)
void add_tape_command(Command app);      ///< cairn tape   (cmd_tape.cpp)
void add_bench_command(Command app);     ///< cairn bench   (cmd_bench.cpp)
void add_profile_command(Command app);   ///< cairn profile   (cmd_profile.cpp)
void add_profile_diff_command(Command app);

}  // namespace cairn::ground
