/// \file A camera that is not there, for tests of whatever uses OpenNI2.
///
/// It is a driver for OpenNI2: a Kinect (640 x 480 or 320 x 240 at 30 Hz, depth and
/// colour) that looks at the scene of scene.h, and fails when it is told to. Any
/// program sees it, and no other camera, with
///
///   LD_LIBRARY_PATH=BUILD/test/virtual_kinect/root VIRTUAL_KINECT="ORDERS" PROGRAM
///
/// where ORDERS are separated by semicolons, as in "fps 0; unplug_at 90;
/// replug_after_ms 500", and may be absent. CMake knows the folder as
/// HOLDFAST_VIRTUAL_OPENNI2_DIR, for the ENVIRONMENT_MODIFICATION of a ctest. A test
/// may link to the driver and give orders while it runs, by command().
///
/// What the devices are; holds for devices that are opened afterwards:
///
///   devices N             that many are plugged in, virtual://0 to virtual://N-1 (1)
///   fps N                 frames a second of real time (30); 0: as fast as can be.
///                         Time stamps are always those of 30 Hz.
///   color 0|1             whether they have such a sensor (1)
///   depth 0|1             the same (1)
///   rgb 0|1               whether colour comes as RGB888 (1), else only as YUV422
///   start_fails 0|1       streams refuse to start (0)
///   mirror_sticks 0|1     images come mirrored, whatever one sets (0)
///
/// What happens to each of them by itself, when frame N after its opening is due:
///
///   unplug_at N           it is unplugged,
///   replug_after_ms N     and comes back after this time (0: never)
///   stall_at N            no more frames
///   error_at N            no more frames, and its state is "error"
///
/// What happens to device D now:
///
///   unplug D, plug D
///   stall D, resume D     no frames, frames again
///   error D, recover D    the same, and its state is "error", "ok"
#pragma once

namespace virtual_kinect {

/// Carries out one order. Aborts on one that it does not know, so that no test passes
/// by a misspelling.
void command(const char* order);

} // namespace virtual_kinect
