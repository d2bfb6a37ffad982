#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "steadyhand/core/result.hpp"

namespace steadyhand {

/// The TLS key of this host, self-signed.
struct Certificate {
  std::string certificate_pem, key_pem;
  std::string fingerprint;  ///< SHA-256 of the certificate as browsers show it, "AB:CD:..."
};

/// $XDG_STATE_HOME/steadyhand, otherwise ~/.local/state/steadyhand. Error: neither variable is set.
Result<std::filesystem::path> state_folder();

/// Reads `folder`/server.pem; makes it when there is none, when it has expired or runs out within a day, or when it
/// does not name all of `names` (DNS names and IP addresses). The file is readable by its owner only. Errors: a folder
/// that cannot be made or written, a file that others may read or that is no certificate with its key.
Result<Certificate> load_or_make_certificate(const std::filesystem::path& folder,
                                             const std::vector<std::string>& names);

/// Addresses of this machine's network interfaces that are up, loopback left out; IPv4 only: what headsets and phones
/// on the same Wi-Fi use.
std::vector<std::string> lan_addresses();
/// The machine's name, and NAME.local.
std::vector<std::string> host_names();

}  // namespace steadyhand
