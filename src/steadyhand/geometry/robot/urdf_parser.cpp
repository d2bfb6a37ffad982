#include <console_bridge/console.h>
#include <fmt/format.h>
#include <tinyxml2.h>
#include <urdf_model/link.h>
#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cctype>
#include <exception>
#include <mutex>
#include <set>
#include <string_view>

#include "steadyhand/geometry/robot/urdf_file.hpp"

namespace steadyhand {

namespace {

using tinyxml2::XMLDocument;
using tinyxml2::XMLElement;

/// Collects what urdfdom would print. urdfdom's handler is one for the whole process, hence the lock.
class Messages : public console_bridge::OutputHandler {
 public:
  Messages() : lock_(mutex_) { console_bridge::useOutputHandler(this); }
  ~Messages() override { console_bridge::restorePreviousOutputHandler(); }

  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level < console_bridge::CONSOLE_BRIDGE_LOG_ERROR) return;
    if (!text_.empty()) text_ += "; ";
    for (const char c : text) text_ += c == '\n' ? ' ' : c;
  }
  const std::string& text() const { return text_; }

 private:
  static inline std::mutex mutex_;
  std::lock_guard<std::mutex> lock_;
  std::string text_;
};

struct Parsed {
  urdf::ModelInterfaceSharedPtr model;  ///< none if urdfdom refuses the text
  std::string complaints;               ///< urdfdom's, also about what it left out of the model
};

Parsed parse(const std::string& text) {
  const Messages messages;
  Parsed parsed;
  try {
    parsed.model = urdf::parseURDF(text);
  } catch (const std::exception& exception) {
    parsed.complaints = exception.what();
  }
  if (!messages.text().empty()) parsed.complaints = messages.text();
  return parsed;
}

std::string printed(const XMLDocument& document) {
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return printer.CStr();
}

/// tinyxml2 takes the declaration in the first line only; many files have their licence before it.
std::string without_declaration(std::string text) {
  const std::size_t begin = text.find("<?xml"), end = text.find("?>", begin);
  if (begin == std::string::npos || end == std::string::npos) return text;
  for (std::size_t i = begin; i < end + 2; ++i) {
    if (text[i] != '\n') text[i] = ' ';
  }
  return text;
}

/// Of tinyxml2's name for it: XML_ERROR_MISMATCHED_ELEMENT is "mismatched element".
std::string words_of(std::string_view error) {
  for (const std::string_view prefix : {"XML_", "ERROR_"}) {
    if (error.starts_with(prefix)) error.remove_prefix(prefix.size());
  }
  std::string words(error);
  std::transform(words.begin(), words.end(), words.begin(),
                 [](unsigned char c) { return c == '_' ? ' ' : std::tolower(c); });
  return words;
}

/// Of any name if it is nullptr.
std::size_t count(const XMLElement& of, const char* name) {
  std::size_t count = 0;
  for (const XMLElement* each = of.FirstChildElement(name); each; each = each->NextSiblingElement(name)) ++count;
  return count;
}

/// Whether the model has every solid of the document.
bool has_all(const urdf::ModelInterface& model, const XMLElement& robot) {
  for (const XMLElement* xml = robot.FirstChildElement("link"); xml; xml = xml->NextSiblingElement("link")) {
    const char* name = xml->Attribute("name");
    const urdf::LinkConstSharedPtr link = name ? model.getLink(name) : nullptr;
    if (!link || link->collision_array.size() != count(*xml, "collision") ||
        link->visual_array.size() != count(*xml, "visual"))
      return false;
  }
  return true;
}

/// Why urdfdom cannot read this element of a link; empty: it can. Materials are left aside: those of other links count.
std::string complaint_about(const XMLElement& element) {
  std::size_t shapes = 0;
  for (const XMLElement* each = element.FirstChildElement("geometry"); each;
       each = each->NextSiblingElement("geometry"))
    shapes += count(*each, nullptr);
  if (shapes > 1) return fmt::format("it has {} shapes, of which one would be read", shapes);
  XMLDocument probe;
  XMLElement* robot = probe.NewElement("robot");
  robot->SetAttribute("name", "probe");
  probe.InsertEndChild(robot);
  XMLElement* link = robot->InsertNewChildElement("link");
  link->SetAttribute("name", "probe");
  tinyxml2::XMLNode* copy = link->InsertEndChild(element.DeepClone(&probe));
  while (XMLElement* material = copy->FirstChildElement("material")) copy->DeleteChild(material);
  const Parsed parsed = parse(printed(probe));
  if (parsed.model && parsed.complaints.empty()) return {};
  const std::string reason = parsed.complaints.substr(0, parsed.complaints.find("Could not parse"));
  const std::size_t end = reason.find_last_not_of("; ");
  return end == std::string::npos ? "it is not complete" : reason.substr(0, end + 1);
}

/// urdfdom leaves out a <visual> for a <material> that has no name. That is a colour and no more.
bool remove_nameless_materials(XMLElement& visual) {
  bool removed = false;
  for (XMLElement *material = visual.FirstChildElement("material"), *next; material; material = next) {
    next = material->NextSiblingElement("material");
    if (material->Attribute("name")) continue;
    visual.DeleteChild(material);
    removed = true;
  }
  return removed;
}

/// Reads a file's XML, step by step; each says why it cannot.
class UrdfReading {
 public:
  UrdfReading(const std::filesystem::path& file, const UrdfText& text) : file_(file.string()), text_(text) {}

  Result<urdf::ModelInterfaceSharedPtr> run(std::vector<UnreadElement>& unread) {
    XMLDocument document;
    document.Parse(without_declaration(text_.text).c_str());
    if (document.Error()) {
      return refuse(
          fmt::format("not well-formed XML: {} in line {}", words_of(document.ErrorName()), document.ErrorLineNum()));
    }
    XMLElement* robot = document.FirstChildElement("robot");
    if (robot == nullptr) return refuse("it has no <robot>");
    if (Status status = check_for_macros(*robot); !status) return status.error();
    for (XMLElement* link = robot->FirstChildElement("link"); link; link = link->NextSiblingElement("link")) {
      if (Status status = take_out_unreadable(*link, unread); !status) return status.error();
    }
    Parsed parsed = parse(changed_ ? printed(document) : text_.text);
    if (!parsed.model) return refuse(parsed.complaints.empty() ? "not well-formed XML" : parsed.complaints);
    if (!has_all(*parsed.model, *robot))
      return refuse("not every element of its links could be read; " + parsed.complaints);
    return parsed.model;
  }

 private:
  Error refuse(const std::string& reason) const {
    return {fmt::format(
        "{} is not a usable URDF: {} (a URDF is XML, <robot> at the top, whose links form one tree: one root, no loop)",
        file_, reason)};
  }

  std::string where(const XMLElement& element) const {
    return text_.expanded ? file_ : fmt::format("{}:{}", file_, element.GetLineNum());
  }

  /// Also finds macros with another prefix for xacro's namespace, which xacro itself ignores.
  Status check_for_macros(const XMLElement& element) {
    for (const auto* each = element.FirstAttribute(); each; each = each->Next()) {
      const std::string_view name = each->Name(), value = each->Value();
      if (name.starts_with("xmlns:") && value.ends_with("/xacro")) macro_prefixes_.emplace(name.substr(6));
    }
    const std::string name = element.Name(), prefix = name.substr(0, name.find(':'));
    if (prefix.size() < name.size() && macro_prefixes_.contains(prefix)) {
      const char* unknown = prefix == "xacro" ? "" : " (which xacro ignores: it expands only <xacro:NAME>)";
      return Error{fmt::format(
          "{}: <{}> is a xacro macro{}. Macros can run any code, so only a robot's file named .xacro is expanded, and "
          "never a cell: rename the file if you trust it, or run `xacro {} > plain.urdf`",
          where(element), name, unknown, file_)};
    }
    for (const XMLElement* child = element.FirstChildElement(); child; child = child->NextSiblingElement()) {
      if (Status status = check_for_macros(*child); !status) return status;
    }
    return Done{};
  }

  Status take_out_unreadable(XMLElement& link, std::vector<UnreadElement>& unread) {
    for (XMLElement *element = link.FirstChildElement(), *next; element; element = next) {
      next = element->NextSiblingElement();
      const std::string name = element->Name();
      if (name != "inertial" && name != "visual" && name != "collision") continue;
      const std::string reason = complaint_about(*element);
      if (reason.empty()) {
        if (name == "visual") changed_ |= remove_nameless_materials(*element);
        continue;
      }
      const char* link_name = link.Attribute("name");
      UnreadElement found{link_name ? link_name : "", name, where(*element), reason};
      if (name == "collision") {
        return Error{fmt::format(
            "{}: the <collision> of link '{}' cannot be read: {}; a <collision> needs a <geometry> with its sizes, and "
            "finite numbers",
            found.where, found.link, found.reason)};
      }
      unread.push_back(std::move(found));
      link.DeleteChild(element);
      changed_ = true;
    }
    return Done{};
  }

  const std::string file_;
  const UrdfText& text_;
  std::set<std::string> macro_prefixes_ = {"xacro"};
  bool changed_ = false;  ///< something was taken out of the document
};

}  // namespace

Result<urdf::ModelInterfaceSharedPtr> parse_urdf(const std::filesystem::path& file, const UrdfText& text,
                                                 std::vector<UnreadElement>& unread) {
  return UrdfReading(file, text).run(unread);
}

}  // namespace steadyhand
