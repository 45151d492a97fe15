# norton: Norton power law (PL)
#
# rate = A*stress**n    [power law]
#
# Numbers below are in MPa and s, temperatures in K: stress is a ratio to 1 MPa, time to 1 s, rates are per s.
# Parameters, for stress as a ratio to 1 MPa and time to 1 s:
#   A = 1.2e-16 1/s, rate coefficient (MPa^-n s^-1 for stress in MPa and time in s)
#   n = 5.2, stress exponent
# Note: n = 5.2 [5.1, 5.3]
# Note: valid from 973 to 1123 K
# Source: Norton (1929), The Creep of Steel at High Temperatures, McGraw-Hill
#
# For NEML2 3.1. PerzynaPlasticFlowRate: rate = (s/reference_stress)^exponent, of the von Mises stress s,
#     which stands in the place of the yield function. The model called `model` makes the stress of strain E
#     and time t.
# 'power law' is called power_law here
[Models]
  [mandel_stress]
    type = IsotropicMandelStress
    cauchy_stress = 'stress'
  []
  [vonmises]
    type = SR2Invariant
    invariant_type = 'VONMISES'
    tensor = 'mandel_stress'
    invariant = 'yield_function'
  []
  [flow]
    type = ComposedModel
    models = 'vonmises'
  []
  [normality]
    type = Normality
    model = 'flow'
    function = 'yield_function'
    from = 'mandel_stress'
    to = 'flow_direction'
  []
  [power_law]
    type = PerzynaPlasticFlowRate
    reference_stress = 1152.645911698
    exponent = 5.2
    flow_rate = 'flow_rate'
  []
  [Eprate]
    type = AssociativePlasticFlow
  []
  [Erate]
    type = SR2VariableRate
    variable = 'E'
  []
  [Eerate]
    type = SR2LinearCombination
    from = 'E_rate plastic_strain_rate'
    to = 'strain_rate'
    weights = '1 -1'
  []
  [elasticity]
    type = LinearIsotropicElasticity
    coefficients = '150000 0.3'
    coefficient_types = 'YOUNGS_MODULUS POISSONS_RATIO'
    rate_form = true
  []
  [integrate_stress]
    type = SR2BackwardEulerTimeIntegration
    variable = 'stress'
  []
  [implicit_rate]
    type = ComposedModel
    models = 'mandel_stress vonmises normality power_law Eprate Erate Eerate elasticity integrate_stress'
  []
  [predictor]
    type = ConstantExtrapolationPredictor
    unknowns_SR2 = 'stress'
  []
  [model]
    type = ImplicitUpdate
    equation_system = 'equations'
    solver = 'newton'
    predictor = 'predictor'
  []
[]
[EquationSystems]
  [equations]
    type = NonlinearSystem
    model = 'implicit_rate'
    unknowns = 'stress'
    residuals = 'stress_residual'
  []
[]
[Solvers]
  [newton]
    type = Newton
    linear_solver = 'lu'
  []
  [lu]
    type = DenseLU
  []
[]
