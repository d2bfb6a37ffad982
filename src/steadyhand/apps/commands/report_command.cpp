#include <fmt/format.h>

#include <filesystem>
#include <iostream>
#include <memory>

#include "steadyhand/apps/commands/commands.hpp"
#include "steadyhand/files/archive/recording_folder.hpp"
#include "steadyhand/operator/console/modest_process.hpp"
#include "steadyhand/operator/console/session_library.hpp"
#include "steadyhand/report/figures/past_session.hpp"

namespace steadyhand {

namespace {

namespace fs = std::filesystem;

struct Options {
  fs::path session, out, folder;
  std::string answer;  ///< to SessionLibrary: a path of docs/reference/protocol.md, "Recorded sessions"
};

/// The sessions of a folder, a line each.
Status list(const Options& options) {
  const fs::path folder = options.folder.empty() ? default_session_folder() : options.folder;
  const std::vector<SessionEntry> sessions = list_sessions(folder);
  if (sessions.empty()) std::cout << "no sessions in " << folder.string() << "\n";
  for (const SessionEntry& s : sessions) {
    const auto figure = [&](const char* key) {
      const auto found = s.summary.find(key);
      return found == s.summary.end() ? std::string("?") : found->second;
    };
    std::cout << fmt::format(
        "{}  {:8.1f} s  {:7.1f} MB  {}\n", s.path.string(), s.duration, 1e-6 * static_cast<double>(s.bytes),
        s.complete ? "engaged " + figure("engaged_s") + " s, latency p99 " + figure("latency_p99_ms") +
                         " ms, missed deadlines " + figure("missed_deadlines")
                   : "cut short");
  }
  return Done{};
}

/// Answers a page's request on stdout; this process then runs next to one that moves an arm.
Status answer(const Options& options) {
  be_modest();
  Result<FreshPage> page = Error{};
  try {
    page = read_library(options.folder, options.answer);
  } catch (const std::bad_alloc&) {
    page = Error{"this session is too long for a report during a live session; run ./steadyhand report later"};
  }
  if (!page) return page.error();
  std::cout << page->body;
  return Done{};
}

Status run(const Options& options) {
  if (!options.answer.empty()) return answer(options);
  if (options.session.empty()) return list(options);
  const fs::path page = options.out.empty() ? fs::path(options.session).replace_extension(".html") : options.out;
  const Result<ReportInput> report = load_session_report(options.session);
  if (!report) return report.error();
  for (const std::string& line : report->lost)
    std::cerr << "steadyhand: " << options.session.string() << ": " << line << "\n";
  if (Status s = write_report(*report, page); !s) return s.error();
  std::cout << format_table(report->profiles) << "\nreport: " << page.string() << "\n";
  return Done{};
}

}  // namespace

void add_report_command(CommandLine& app, Command& chosen) {
  const auto options = std::make_shared<Options>();
  CommandLine* command = app.add_subcommand("report", "Write a report of a session; without a session, list them");
  command->add_option("session", options->session, "SESSION.mcap of a live session or a replay, also one cut short");
  command->add_option("--out", options->out, "Report file; default: SESSION.html next to the session");
  command->add_option("--sessions", options->folder, "Folder to list; default: " + default_session_folder().string());
  command->add_option("--answer", options->answer, "For SessionLibrary alone")->group("");
  command->callback([options, &chosen] { chosen = [options] { return run(*options); }; });
}

}  // namespace steadyhand
