"""allanite: noise models of inertial sensors."""
