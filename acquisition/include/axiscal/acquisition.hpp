// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/acquisition/assembly_session.hpp"
#include "axiscal/acquisition/health_watch.hpp"
#include "axiscal/acquisition/journal.hpp"
#include "axiscal/acquisition/open_source.hpp"
#include "axiscal/acquisition/pose_model.hpp"
#include "axiscal/acquisition/pose_path.hpp"
#include "axiscal/acquisition/sample_feed.hpp"
#include "axiscal/acquisition/session.hpp"
#include "axiscal/acquisition/session_face.hpp"
#include "axiscal/acquisition/session_header.hpp"
#include "axiscal/acquisition/session_json.hpp"
#include "axiscal/acquisition/simulated_source.hpp"
#include "axiscal/acquisition/source.hpp"
#include "axiscal/acquisition/stillness.hpp"
#include "axiscal/acquisition/web_face.hpp"

/// @file
/// A live instrument: sources of samples, the guided session, its journal and its faces.
///
/// A Source is a serial port, a socket, a file, a simulation, by its address; a SampleFeed reads
/// several as one; a Session takes samples and commands and gives a view, events, and at the end a
/// calibration; faces show it on a terminal or in a browser.
///
/// @code
/// for (const axiscal::SourceKind& kind : axiscal::source_kinds()) {
///   std::printf("%s%s\n", kind.address.c_str(), kind.available ? "" : " (not in this build)");
/// }
/// @endcode
///
/// Traps:
/// - A reading is said to be captured only when the journal has it on the disk; a full disk stops
///   the session, not the program.
/// - The same samples and commands give the same readings: a journal with raw samples can be run
///   again.
