#pragma once
#include <string>

#include "app/workbench/web_server.hpp"

namespace sidewall::app {

class OpenedFolder;

/// Answers requests of the workbench's page: edit, check and preview recipes; start, stop and show runs.
///
/// All state is in the folder's files. Runs are separate processes: page and command line can each resume
/// what the other began. Work that needs much memory or time is done by other processes of this program.
class Workbench {
  public:
    /// \param recipe  name in the folder of the recipe to open first; may be empty.
    Workbench(const OpenedFolder& folder, std::string recipe);

    /// Answers a request; thread-safe. Errors that the user can correct give {"problem": ...} and status 200.
    WebReply answer(const WebRequest& request) const;

  private:
    const OpenedFolder& folder_;
    std::string recipe_;
};

}  // namespace sidewall::app
