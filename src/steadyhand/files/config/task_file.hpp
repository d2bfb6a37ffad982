#pragma once

#include <string>

#include "steadyhand/files/config/places.hpp"
#include "steadyhand/session/task/task.hpp"

namespace steadyhand {

/// Reads tasks/NAME.yaml (its keys: docs/reference/tasks.md). Fails as YamlMap says.
Result<Task> load_task(const std::filesystem::path& file);

/// A task by name ("carry") or by the path of its file; "none" has no name and nothing else.
Result<Task> open_task(const std::string& name, const Places& places = Places::standard());

}  // namespace steadyhand
