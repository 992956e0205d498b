/// \file How the file of a cloud was read, as results tell it.
#pragma once

#include <holdfast/io/cloud_io.h>

#include <nlohmann/json.hpp>

namespace holdfast::io {

/// The "input" of a result. Its "turn" leads from camera axes to those of the file's
/// sensor frame.
nlohmann::ordered_json inputJson(const CloudFileInfo& file);

/// Of what inputJson() has written: format, camera, depth scale, unit and axes, so that
/// the file can be read so again. \throw nlohmann::json::exception or
/// std::runtime_error when it is nothing of the kind.
CloudFileInfo inputFromJson(const nlohmann::json& json);

} // namespace holdfast::io
