#include "viewer.h"

#include "module.h"

#include <stdexcept>

namespace holdfast::app {

std::unique_ptr<Viewer>
openViewer(const std::string& note)
{
  decltype(&holdfastOpenViewer) open = nullptr;
  try {
    open = reinterpret_cast<decltype(open)>(
        loadModuleFunction("holdfast_viewer", "holdfastOpenViewer"));
  }
  catch (const std::runtime_error& error) {
    throw std::runtime_error(std::string("--view: ") + error.what());
  }
  return std::unique_ptr<Viewer>(open(note));
}

} // namespace holdfast::app
