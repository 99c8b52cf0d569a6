#pragma once
#include <string>
#include <vector>

namespace unrig {

/// Runs that belong together: one rig, and what is asked of them. Paths are as the file has them, from its folder.
struct BatchCampaign {
  std::string name;
  std::string rig;
  std::vector<std::string> runs;     ///< fitted together
  std::vector<std::string> heldout;  ///< predicted by `diagnose`
  std::vector<std::string> further;  ///< corrected with the fit, and no part of it
  std::vector<std::string> commands; ///< of batch_commands, in that order
  std::vector<std::string> effects;     ///< at work in the fit
  std::vector<std::string> laws;        ///< files of laws at work in the fit
  std::vector<std::string> candidates;  ///< of the diagnosis; empty: all that can act
  bool anyway = false;

  /// runs, heldout and further, in this order.
  std::vector<std::string> all_runs() const;
};

struct Batch {
  std::string file;
  std::string folder;  ///< of the file, where its paths begin
  std::vector<BatchCampaign> campaigns;
};

/// What can be asked of a campaign, in the order in which it is done.
extern const std::vector<std::string> batch_commands;

/// Reads a file of campaigns (correct/manual/batch.md). Patterns (`*`, `?`, `[..]`) stand for the files and folders that match, in alphabetical order. A file that is named
/// need not exist: that is for its row to say.
///
/// Throws InputError with the line for unknown keys, commands and effects, a pattern that nothing matches, a run or a name that stands there twice, and keys that no command of the campaign reads.
Batch read_batch(const std::string& path);

}  // namespace unrig
