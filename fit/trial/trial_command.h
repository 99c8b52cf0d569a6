#pragma once

namespace unrig {

/// `unrig trial --rig rig.toml [RUN...] [--effects a,b,...] [--trials N] [--seed S] [--noise "0.03 N"] -o trial.json`
int trial_command(int argc, char** argv);

}  // namespace unrig
