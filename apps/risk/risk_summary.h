/// \file Footholds in words and a table for people.
#pragma once

#include "risk/risk_report.h"

#include <string>

namespace holdfast::app {

/// Why there is no foothold at all; one line without the file. Empty when there is one.
std::string causeOfNone(const RiskReport& report);

/// The best ten, what was left out, and which load and foot it is about.
std::string riskTable(const RiskReport& report);

/// "0 -0.5 0.866".
std::string vectorText(const Eigen::Vector3d& v);

} // namespace holdfast::app
