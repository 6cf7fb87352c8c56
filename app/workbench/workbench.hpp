#pragma once
#include <memory>
#include <string>

#include "app/workbench/web_server.hpp"

namespace sidewall::app {

class OpenedFolder;

/// What the page of the workbench asks for: recipes to edit, checks and previews of them, runs to start, stop and look at.
///
/// All state is in the folder's files: runs are processes of their own, which the command line can go on with, and the other way
/// round. What needs much memory or time is asked of other processes of this program.
class Workbench {
  public:
    /// \param recipe  in the folder, to begin with; may be empty.
    Workbench(const OpenedFolder& folder, std::string recipe);

    /// Answers a request; for any thread. What the user has to mend comes as {"problem": ...} with status 200.
    WebReply answer(const WebRequest& request) const;

  private:
    const OpenedFolder& folder_;
    std::string recipe_;
};

}  // namespace sidewall::app
