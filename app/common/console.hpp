#pragma once

namespace sidewall::app {

/// Secures the standard streams before anything is opened. The numbers of closed ones are taken, so that no file of
/// results gets them and messages with it; writing to a closed standard output still fails. Messages on standard
/// error that cannot be written, as on a full disk, are lost without a failure.
void secure_standard_streams();

}  // namespace sidewall::app
