#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <map>
#include <span>
#include <string_view>

#include "steadyhand/report/figures/page_data.hpp"
#include "steadyhand/report/figures/report.hpp"
#include "steadyhand/report/figures/session_story.hpp"
#include "steadyhand/report/figures/table.hpp"

namespace steadyhand {

namespace embedded {
extern const std::string_view page_html, page_css, page_js, story_js, uplot_css, uplot_js;
}

namespace {

std::string escape(std::string_view text) {
  std::string html;
  for (const char c : text) {
    switch (c) {
      case '&':
        html += "&amp;";
        break;
      case '<':
        html += "&lt;";
        break;
      case '>':
        html += "&gt;";
        break;
      case '"':
        html += "&quot;";
        break;
      default:
        html += c;
    }
  }
  return html;
}

/// Replaces every {{name}} of the template, once: what comes in is not looked through again.
std::string fill(std::string_view page, const std::map<std::string_view, std::string_view>& values) {
  std::string filled;
  for (;;) {
    const std::size_t open = page.find("{{"), close = page.find("}}", open);
    filled += page.substr(0, open);
    if (close == std::string_view::npos) return filled;
    filled += values.at(page.substr(open + 2, close - open - 2));
    page.remove_prefix(close + 2);
  }
}

/// The colour of a profile, which page.css has by its name; of one that it does not know, the i-th other one.
std::string color(const ReportInput& input, std::size_t i) {
  const std::string& name = input.profiles[i].name;
  const bool plain = !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '-' || c == '_';
  });
  const std::string other = fmt::format("var(--profile-other-{})", i % 3 + 1);
  return "--color: " + (plain ? fmt::format("var(--profile-{}, {})", name, other) : other);
}

/// "13 % of P1 tracking" or "2.6 × P1 tracking", or nothing for the first profile.
std::string compared(double value, double first, const ReportInput& input, std::size_t i) {
  if (i == 0 || !(first > 0)) return "";
  const double ratio = value / first;
  if (ratio >= 100.0) return "";  // of a profile that hardly led
  return fmt::format("<small>{} {}</small>",
                     ratio < 1 ? fmt::format("{:.0f} % of", 100 * ratio) : fmt::format("{:.1f} ×", ratio),
                     escape(input.profiles.front().label));
}

/// "2 ×, at most 74.4", of which the unit is %, "once, 3.6", or "0".
std::string spills_text(const Metrics& m) {
  if (!(m.spills > 0)) return "0";
  const std::string share = percent_text(m.spilled_share), many = fmt::format("{:.0f} ×, ", m.spills);
  if (share.rfind("less", 0) == 0) return (m.spills > 1 ? many + "each " : "once, ") + share;
  return m.spills > 1 ? many + "at most " + share : "once, " + share;
}

/// m:ss.ss, as the operator's page has times.
std::string clock_text(double seconds) {
  const auto hundredths = std::llround(100.0 * std::max(0.0, seconds));
  return fmt::format("{}:{:05.2f}", hundredths / 6000, static_cast<double>(hundredths % 6000) / 100.0);
}

bool has_glass(const ReportInput& input) { return !input.story || input.story->has_glass; }

/// "lateral 0.4, posture 1 1 2" with the terms in words, each with its name in a profile's file as what is told of it.
std::string weights_html(const Weights& weights) {
  std::string html;
  for (const auto& [name, values] : weights) {
    if (values.empty()) continue;
    html += fmt::format("{}<span title=\"{}\">{}</span> {}", html.empty() ? "" : ", ", escape(name),
                        escape(term_text(name)), weight_text(values));
  }
  return html;
}

/// Of a further result of the same profile, which its curves are drawn with, too.
bool is_dashed(const ReportInput& input, std::size_t i) {
  return std::any_of(input.profiles.begin(), input.profiles.begin() + static_cast<std::ptrdiff_t>(i),
                     [&](const ProfileResult& before) { return before.name == input.profiles[i].name; });
}

std::string cards(const ReportInput& input, const std::vector<Metrics>& metrics) {
  const bool knows_spills = std::any_of(metrics.begin(), metrics.end(), [](const Metrics& m) { return m.spills >= 0; });
  const bool spilled = std::any_of(metrics.begin(), metrics.end(), [](const Metrics& m) { return m.spills > 0; });
  std::string html;
  for (std::size_t i = 0; i < metrics.size(); ++i) {
    const ProfileResult& profile = input.profiles[i];
    const Metrics &m = metrics[i], &first = metrics.front();
    int row_count = 0;
    const auto row = [&](std::string_view what, const std::string& value, std::string_view unit, double now,
                         double before) {
      ++row_count;
      return fmt::format("<div><dt>{}</dt><dd><b>{}</b> {}{}</dd></div>\n", what, value, unit,
                         compared(now, before, input, i));
    };
    std::string rows;
    if (input.story) {  // in the words and figures of the operator's page
      rows += row("led", clock_text(profile.led_s), "", 0.0, 0.0);
      if (knows_spills) rows += row("spilled", spills_text(m), m.spills > 0 ? "%" : "", 0.0, 0.0);
      if (spilled) {
        rows += row("spills per minute led",
                    std::isnan(m.spills_per_minute) ? "–" : fmt::format("{:.2f}", m.spills_per_minute), "",
                    m.spills_per_minute, first.spills_per_minute);
      }
      if (has_glass(input)) {
        rows += row("slosh, mean", fmt::format("{:.2f}", m.lateral_mean), "m/s²", m.lateral_mean, first.lateral_mean);
        rows += row("slosh, peak", fmt::format("{:.2f}", m.lateral_max), "m/s²", m.lateral_max, first.lateral_max);
      }
      rows += row("off target, mean", fmt::format("{:.1f}", 1e3 * m.position_mean), "mm", m.position_mean,
                  first.position_mean);
    } else {
      rows += row("slosh, mean", fmt::format("{:.2f}", m.lateral_mean), "m/s²", m.lateral_mean, first.lateral_mean);
      rows += row("position error, RMS", fmt::format("{:.1f}", 1e3 * m.position_rms), "mm", m.position_rms,
                  first.position_rms);
    }
    rows += row("solve time, mean", fmt::format("{:.0f}", m.solve_mean), "µs", m.solve_mean, first.solve_mean);
    html += fmt::format(
        R"(<article class="card" style="{}{}; --rows: {}">
<h3><label><input type="checkbox" data-profile="{}" checked> {}</label></h3>
<p class="weights">{}</p>
<dl>
{}</dl>
</article>
)",
        color(input, i), is_dashed(input, i) ? "; border-top-style: dashed" : "", 2 + row_count, i,
        escape(profile.label), weights_html(profile.weights), rows);
  }
  return html;
}

/// Index of the profile that does best in this row, or -1: no merit, only one profile, or a tie as shown. What led for
/// a moment only is not compared.
int best_profile(const MetricRow& row, const std::vector<Metrics>& metrics) {
  constexpr int kMoment = 5;  // one in so many steps of the longest
  int longest = 0;
  for (const Metrics& m : metrics) longest = std::max(longest, m.steps);
  const auto counts = [longest](const Metrics& m) { return kMoment * m.steps >= longest; };
  if (row.best == MetricRow::Best::kNone || std::count_if(metrics.begin(), metrics.end(), counts) < 2) return -1;
  const double sign = row.best == MetricRow::Best::kLowest ? 1 : -1;
  const auto better = [&](const Metrics& a, const Metrics& b) {
    return counts(a) == counts(b) ? sign * row.value(a) < sign * row.value(b) : counts(a);
  };
  const auto best = std::min_element(metrics.begin(), metrics.end(), better);
  const auto ties = std::count_if(metrics.begin(), metrics.end(),
                                  [&](const Metrics& m) { return format_value(row, m) == format_value(row, *best); });
  return ties > 1 ? -1 : static_cast<int>(best - metrics.begin());
}

/// What drives a glass's liquid has one name on the operator's page and here.
std::string label_of(const ReportInput& input, const MetricRow& row) {
  constexpr std::string_view kForce = "Lateral specific force";
  const std::string_view label = row.label;
  if (!has_glass(input) || !label.starts_with(kForce)) return row.label;
  return "Slosh" + std::string(label.substr(kForce.size()));
}

std::string table_row(const ReportInput& input, const MetricRow& row, const std::vector<Metrics>& metrics) {
  const std::string unit = *row.unit ? fmt::format(" <span class=\"unit\">{}</span>", row.unit) : "";
  std::string html = fmt::format("<tr><th scope=\"row\">{}{}</th>", label_of(input, row), unit);
  const int best = best_profile(row, metrics);
  for (std::size_t i = 0; i < metrics.size(); ++i) {
    const std::string value = escape(format_value(row, metrics[i]));
    html += static_cast<int>(i) == best
                ? fmt::format("<td class=\"best\">{}<span class=\"hidden\"> (best)</span></td>", value)
                : fmt::format("<td>{}</td>", value);
  }
  return html + "</tr>\n";
}

/// What bold figures are, where there are some.
std::string bold_note(const std::vector<Metrics>& metrics) {
  const std::span<const MetricRow> rows = metric_rows();
  const bool some = std::any_of(rows.begin(), rows.end(), [&](const MetricRow& row) {
    return is_known(row, metrics) && best_profile(row, metrics) >= 0;
  });
  return some ? "    <p class=\"lead\">Bold: the best of those that led for long enough to compare.</p>\n" : "";
}

/// One table per group of rows.
std::string tables(const ReportInput& input, const std::vector<Metrics>& metrics) {
  std::string heads;
  for (std::size_t i = 0; i < metrics.size(); ++i) {
    heads += fmt::format("<th scope=\"col\" style=\"{}\"><span>{}</span></th>", color(input, i),
                         escape(input.profiles[i].label));
  }
  std::string html, group;
  for (const MetricRow& row : metric_rows()) {
    if (!is_known(row, metrics)) continue;
    if (group != row.group) {
      if (!group.empty()) html += "</tbody></table>\n";
      group = row.group;
      const std::string heading = group == "Glass" && !has_glass(input) ? "Gripper" : group;
      html += fmt::format("<table data-group=\"{0}\"><thead><tr><th scope=\"col\">{0}</th>{1}</tr></thead><tbody>\n",
                          heading, heads);
    }
    html += table_row(input, row, metrics);
  }
  return html + "</tbody></table>\n";
}

std::string meanings(const ReportInput& input, const std::vector<Metrics>& metrics) {
  std::string html;
  for (const MetricRow& row : metric_rows()) {
    if (is_known(row, metrics)) html += fmt::format("<dt>{}</dt><dd>{}</dd>\n", label_of(input, row), row.meaning);
  }
  return html;
}

/// Whether the glass kept its liquid, how much it lost, and why, the worst first: what one wants to know of a session.
std::string verdict(const std::optional<SessionStory>& story) {
  if (!story || !story->knows_liquid) return "";
  if (story->spills.empty()) return "<p class=\"verdict\">Nothing spilled.</p>\n";
  constexpr std::size_t kMostTold = 5;
  constexpr double kTrace = 0.0005;  // of the liquid
  std::vector<SessionStory::Spill> spills = story->spills;
  const std::size_t count = spills.size();
  std::stable_sort(spills.begin(), spills.end(), [](const auto& a, const auto& b) { return a.share > b.share; });
  const auto traces = std::find_if(spills.begin() + 1, spills.end(), [](const auto& s) { return s.share < kTrace; });
  const std::size_t told = std::min(static_cast<std::size_t>(traces - spills.begin()), kMostTold);
  std::string html = fmt::format("<div class=\"verdict spilled\"><p>Spilled {}.</p><ul>\n",
                                 count == 1 ? "once" : fmt::format("{} times", count));
  const auto add = [&html](const SessionStory::Spill& spill) {
    html += fmt::format("<li><b>{} %</b> <a href=\"#t={:.3f}\">at {}</a>: {}</li>\n", percent_text(spill.share),
                        spill.t_s, clock_text(spill.t_s), escape(spill.cause));
  };
  const auto rest = spills.begin() + static_cast<std::ptrdiff_t>(told);
  std::for_each(spills.begin(), rest, add);
  if (told < count) {
    const std::string share = percent_text(rest->share), at_most = rest->share < kTrace ? "" : "at most ";
    html += fmt::format("<li><details><summary>{} more, of {}{} %</summary><ul>\n", count - told, at_most, share);
    std::for_each(rest, spills.end(), add);
    html += "</ul></details></li>\n";
  }
  return html + "</ul></div>\n";
}

/// "25 November 2026, 15:20:10" of a name that was made then; empty of other names.
std::string date_of(const std::string& name) {
  constexpr const char* kMonths[] = {"January", "February", "March",     "April",   "May",      "June",
                                     "July",    "August",   "September", "October", "November", "December"};
  int year = 0, month = 0, day = 0, hour = 0, minute = 0, second = 0, length = 0;
  const bool made = std::sscanf(name.c_str(), "%4d-%2d-%2d_%2d-%2d-%2d%n", &year, &month, &day, &hour, &minute, &second,
                                &length) == 6;
  if (!made || month < 1 || month > 12) return {};
  const std::string rest = name.substr(static_cast<std::size_t>(length));  // "_2": of the same program
  return fmt::format("{} {} {}, {:02}:{:02}:{:02}{}", day, kMonths[month - 1], year, hour, minute, second,
                     rest.size() > 1 && rest.front() == '_' ? " (" + rest.substr(1) + ")" : rest);
}

/// What people call it, and when it was made, as far as that is known.
std::string title_of(const ReportInput& input) {
  constexpr std::size_t kDate = 19;  // of DATE_TIME, without "UTC"
  const std::string named = date_of(input.recording);
  const std::string began = date_of(named.empty() ? input.recorded : input.recorded.substr(0, kDate));
  const std::string& date = began.empty() ? named : began;  // several files of a program have one name
  const std::string called = input.title.empty() && named.empty() ? input.recording : input.title;
  return called.empty() ? date : called + (date.empty() ? "" : ", " + date);
}

std::string thinning_note(const Thinning& thinning, int commands_merged, bool live) {
  std::string note;
  if (live) note += "Curves are those of the plans; what was led, and the slosh in figures, are as measured. ";
  if (thinning.steps_per_point > 1) {
    note += fmt::format(
        "A point of a curve stands for {} planning steps: the worst of them where worse has a meaning, the first "
        "otherwise. ",
        thinning.steps_per_point);
  }
  if (const int commands = thinning.commands_per_point * commands_merged; commands > 1) {
    note += fmt::format("A point of a joint's speed is the largest of {} commands. ", commands);
  }
  return note + "The figures in the tables use every sample that was recorded.";
}

}  // namespace

Result<std::string> report_page(const ReportInput& input) {
  if (input.profiles.empty()) return Error{"a report needs at least one profile"};
  std::vector<Metrics> metrics;
  double duration = 0;
  for (const ProfileResult& profile : input.profiles) {
    if (profile.steps.empty()) {
      return Error{fmt::format("profile {} has no planning steps to report", profile.name)};
    }
    metrics.push_back(metrics_of(profile));
    duration = std::max(duration, profile.steps.back().t_s - profile.steps.front().t_s);
  }
  if (input.story) duration = input.story->end_s - input.story->begin_s;
  const Thinning thinning = choose_thinning(input);
  const std::string recording = escape(input.recording), rate = fmt::format("{:g} Hz", input.rate_hz),
                    scale = input.scales.empty() ? fmt::format("{:g}", input.scale) : input.scales,
                    length = input.story
                                 ? fmt::format("{}, {} of it led", clock_text(duration), clock_text(input.story->led_s))
                                 : fmt::format("{:.1f} s", duration),
                    command = escape(input.command), card_html = cards(input, metrics),
                    table_html = tables(input, metrics), meaning_html = meanings(input, metrics),
                    title = escape(title_of(input)), verdict_html = verdict(input.story),
                    note = thinning_note(thinning, input.profiles.front().commands_merged, input.story.has_value()),
                    bold = bold_note(metrics), data = page_data(input, thinning);
  return fill(embedded::page_html, {{"recording", recording},
                                    {"title", title},
                                    {"tool", has_glass(input) ? "glass" : "gripper"},
                                    {"verdict", verdict_html},
                                    {"rate", rate},
                                    {"scale", scale},
                                    {"duration", length},
                                    {"command", command},
                                    {"cards", card_html},
                                    {"bold", bold},
                                    {"tables", table_html},
                                    {"meanings", meaning_html},
                                    {"thinning", note},
                                    {"data", data},
                                    {"page_css", embedded::page_css},
                                    {"page_js", embedded::page_js},
                                    {"story_js", embedded::story_js},
                                    {"uplot_css", embedded::uplot_css},
                                    {"uplot_js", embedded::uplot_js}});
}

Status write_report(const ReportInput& input, const std::filesystem::path& path) {
  const Result<std::string> page = report_page(input);
  if (!page) return Error{path.string() + ": " + page.error().message};
  std::ofstream file(path, std::ios::binary);
  file << *page;
  file.close();
  if (!file) return Error{fmt::format("{}: cannot be written: {}", path.string(), std::strerror(errno))};
  return Done{};
}

}  // namespace steadyhand
