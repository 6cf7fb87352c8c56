#pragma once
#include <string>

#include "app/workbench/web_server.hpp"

namespace sidewall::app {

class OpenedFolder;

/// Answers a request of the workbench's page: edits, checks and previews recipes; starts, stops and shows runs.
///
/// All state is in the folder's files. Runs are separate processes: page and command line can each resume
/// what the other began. Work that needs much memory or time is done by other processes of this program.
/// Thread-safe. Errors that the user can correct give {"problem": ...} and status 200.
/// \param recipe  name in the folder of the recipe to open first; may be empty.
WebReply workbench_reply(const WebRequest& request, const OpenedFolder& folder, const std::string& recipe);

}  // namespace sidewall::app
