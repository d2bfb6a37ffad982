// An MCAP file, and a session in it.
#include "fuzz/fuzz.hpp"
#include "steadyhand/files/record/session_file.hpp"

namespace steadyhand {

FUZZ(mcap) {
  const std::filesystem::path path = fuzz::as_file(input);
  std::uint64_t messages = 0;
  const auto count = [&](const McapMessage&) -> Status {
    ++messages;
    return Done{};
  };
  const Result<McapOverview> overview = read_mcap(path, count);
  if (overview) fuzz::require(overview->end <= input.size() && overview->any == (messages > 0), "an overview");
  (void)read_mcap(path);
  SessionParts parts;
  parts.samples = parts.steps = parts.commands = parts.states = parts.changes = parts.settings = true;
  const Result<SessionFile> session = load_session(path, parts);
  if (!session) return fuzz::require(!session.error().message.empty(), "a refusal says why");
  for (const JointState& state : session->states) fuzz::require(state.q.size() == state.dq.size(), "a state's sizes");
}

}  // namespace steadyhand
