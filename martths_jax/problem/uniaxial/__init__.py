"""The uniaxial benchmark (Silva et al. 2020): three storeys, one actuator on the first."""
