// The one static object of the flight module.
#include "app/flight_app.hpp"

namespace cairn::app {

FlightApp root;

}  // namespace cairn::app
