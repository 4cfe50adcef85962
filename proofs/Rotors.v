(** From place and heading to tilt, the body's rates and the rotors' thrusts.

    In the frame turned by the heading (p, q, w) is the force over the mass, (jx, jy, jz) and
    (sx, sy, sz) are its first two derivatives turned likewise, F is the force's length, and
    D = p^2 + w^2 = G^2.  [turn] is the heading's rate. *)

Require Import Reals Lra Psatz.
From LtlPlan Require Import Vectors.
Open Scope R_scope.

(** ** Limits that are multiplied out *)

Lemma squares_le : forall a b, 0 <= b -> a * a <= b * b -> a <= b.
Proof. intros a b Hb H; apply (square_le a b); auto. Qed.

Theorem speed_kept : forall v limit, 0 <= limit -> dot v v <= limit * limit -> sqrt (dot v v) <= limit.
Proof.
  intros v l L H; apply squares_le; auto; rewrite sqrt_sqrt; auto using dot_square.
Qed.

(** [k] is at or above the greatest tilt's cosine. *)
Theorem tilt_kept : forall f k tilt, 0 <= k -> cos tilt <= k -> 0 < dot f f -> 0 <= vz f ->
  k * k * dot f f <= vz f * vz f -> cos tilt <= vz f / sqrt (dot f f).
Proof.
  intros f k tilt K C P Z H; pose proof (sqrt_lt_R0 _ P) as S.
  assert (E : sqrt (dot f f) * sqrt (dot f f) = dot f f) by (apply sqrt_sqrt; lra).
  set (n := sqrt (dot f f)) in *; clearbody n.
  apply Rle_trans with k; auto; apply Rmult_le_reg_r with n; auto.
  replace (vz f / n * n) with (vz f) by (field; lra).
  apply squares_le; auto; replace (k * n * (k * n)) with (k * k * (n * n)) by ring; rewrite E; auto.
Qed.

Definition cross (a b : vec) : vec :=
  Vec (vy a * vz b - vz a * vy b) (vz a * vx b - vx a * vz b) (vx a * vy b - vy a * vx b).

Theorem rate_kept : forall f j limit, 0 <= limit -> 0 < dot f f ->
  dot (cross j f) (cross j f) <= limit * limit * (dot f f * dot f f) ->
  sqrt (dot (cross j f) (cross j f)) / dot f f <= limit.
Proof.
  intros f j l L P H; apply Rmult_le_reg_r with (dot f f); auto.
  replace (sqrt (dot (cross j f) (cross j f)) / dot f f * dot f f) with (sqrt (dot (cross j f) (cross j f))) by (field; lra).
  apply squares_le; [apply Rmult_le_pos; lra|]; rewrite sqrt_sqrt by apply dot_square; nra.
Qed.

(** ** What the turned frame's coordinates become *)

Section Turned.
  Variables (x y psi x' y' psi' : R -> R) (t : R).
  Hypothesis Dx : derivable_pt_lim x t (x' t).
  Hypothesis Dy : derivable_pt_lim y t (y' t).
  Hypothesis Dpsi : derivable_pt_lim psi t (psi' t).

  Definition ahead (u : R) : R := x u * cos (psi u) + y u * sin (psi u).
  Definition left (u : R) : R := y u * cos (psi u) - x u * sin (psi u).
  Definition ahead' (u : R) : R := x' u * cos (psi u) + y' u * sin (psi u).
  Definition left' (u : R) : R := y' u * cos (psi u) - x' u * sin (psi u).

  Lemma cos_psi : derivable_pt_lim (fun u => cos (psi u)) t (- sin (psi t) * psi' t).
  Proof. apply (derivable_pt_lim_comp psi cos); auto; apply derivable_pt_lim_cos. Qed.
  Lemma sin_psi : derivable_pt_lim (fun u => sin (psi u)) t (cos (psi t) * psi' t).
  Proof. apply (derivable_pt_lim_comp psi sin); auto; apply derivable_pt_lim_sin. Qed.

  Theorem turned_slopes :
    derivable_pt_lim ahead t (ahead' t + psi' t * left t) /\
    derivable_pt_lim left t (left' t - psi' t * ahead t).
  Proof.
    pose proof cos_psi as C; pose proof sin_psi as S; split.
    - replace (ahead' t + psi' t * left t) with
        ((x' t * cos (psi t) + x t * (- sin (psi t) * psi' t)) + (y' t * sin (psi t) + y t * (cos (psi t) * psi' t)))
        by (unfold ahead', left; ring).
      apply (derivable_pt_lim_plus (fun u => x u * cos (psi u)) (fun u => y u * sin (psi u))).
      + apply (derivable_pt_lim_mult x (fun u => cos (psi u))); auto.
      + apply (derivable_pt_lim_mult y (fun u => sin (psi u))); auto.
    - replace (left' t - psi' t * ahead t) with
        ((y' t * cos (psi t) + y t * (- sin (psi t) * psi' t)) - (x' t * sin (psi t) + x t * (cos (psi t) * psi' t)))
        by (unfold left', ahead; ring).
      apply (derivable_pt_lim_minus (fun u => y u * cos (psi u)) (fun u => x u * sin (psi u))).
      + apply (derivable_pt_lim_mult y (fun u => cos (psi u))); auto.
      + apply (derivable_pt_lim_mult x (fun u => sin (psi u))); auto.
  Qed.
End Turned.

(** ** The body's axes, rates and their derivatives *)

Section Body.
  Variables p q w jx jy jz sx sy sz turn F G : R.
  Hypothesis F_positive : 0 < F.
  Hypothesis G_positive : 0 < G.
  Hypothesis F_square : F * F = p * p + q * q + w * w.
  Hypothesis G_square : G * G = p * p + w * w.

  Let D : R := G * G.
  Let K : R := jx * w - p * jz.
  Definition x_axis : vec := Vec (w / G) 0 (- p / G).
  Definition y_axis : vec := Vec (- (p * q) / (F * G)) (D / (F * G)) (- (q * w) / (F * G)).
  Definition z_axis : vec := Vec (p / F) (q / F) (w / F).

  (** The three are orthonormal, and right-handed. *)
  Theorem body_axes :
    dot x_axis x_axis = 1 /\ dot y_axis y_axis = 1 /\ dot z_axis z_axis = 1 /\
    dot x_axis y_axis = 0 /\ dot x_axis z_axis = 0 /\ dot y_axis z_axis = 0 /\
    cross z_axis x_axis = y_axis.
  Proof.
    assert (FF : F * F = q * q + D) by (unfold D; lra).
    assert (X : dot x_axis x_axis = (p * p + w * w) / (G * G)) by (unfold dot, x_axis; simpl; field; lra).
    assert (Y : dot y_axis y_axis = (q * q * (p * p + w * w) + D * D) / (F * F * (G * G)))
      by (unfold dot, y_axis; simpl; field; lra).
    assert (Z : dot z_axis z_axis = (p * p + q * q + w * w) / (F * F)) by (unfold dot, z_axis; simpl; field; lra).
    assert (FG : F * F <> 0) by (apply Rmult_integral_contrapositive; lra).
    assert (GG : G * G <> 0) by (apply Rmult_integral_contrapositive; lra).
    repeat split.
    - rewrite X, <- G_square; field; lra.
    - rewrite Y, <- G_square; fold D; replace (q * q * D + D * D) with ((q * q + D) * D) by ring.
      rewrite <- FF; unfold D; field; lra.
    - rewrite Z, <- F_square; field; lra.
    - unfold dot, x_axis, y_axis; simpl; field; lra.
    - unfold dot, x_axis, z_axis; simpl; field; lra.
    - unfold dot, y_axis, z_axis; simpl.
      replace (- (p * q) / (F * G) * (p / F) + D / (F * G) * (q / F) + - (q * w) / (F * G) * (w / F))
        with (q * (D - (p * p + w * w)) / (F * F * G)) by (field; lra).
      rewrite <- G_square; unfold D; field; lra.
    - unfold cross, x_axis, y_axis, z_axis; simpl; f_equal; try (field; lra).
      unfold D; rewrite G_square; field; lra.
  Qed.

  (** Rates: the force's derivative is F' z + F (omega x z), with omega x z = y z-rate ... *)
  Variables F' rate_x rate_y rate_z : R.
  Hypothesis jerk : Vec jx jy jz = add (scale F' z_axis) (scale F (sub (scale rate_y x_axis) (scale rate_x y_axis))).

  Theorem rates : rate_y = K / (F * G) /\ rate_x = ((p * jx + w * jz) * q - D * jy) / (F * F * G).
  Proof.
    destruct body_axes as (XX & YY & ZZ & XY & XZ & YZ & _).
    assert (X : dot (Vec jx jy jz) x_axis = F * rate_y).
    { rewrite jerk.
      replace (dot (add (scale F' z_axis) (scale F (sub (scale rate_y x_axis) (scale rate_x y_axis)))) x_axis)
        with (F' * dot x_axis z_axis + F * (rate_y * dot x_axis x_axis - rate_x * dot x_axis y_axis))
        by (unfold dot, add, scale, sub; simpl; ring).
      rewrite XX, XY, XZ; ring. }
    assert (Y : dot (Vec jx jy jz) y_axis = - F * rate_x).
    { rewrite jerk.
      replace (dot (add (scale F' z_axis) (scale F (sub (scale rate_y x_axis) (scale rate_x y_axis)))) y_axis)
        with (F' * dot y_axis z_axis + F * (rate_y * dot x_axis y_axis - rate_x * dot y_axis y_axis))
        by (unfold dot, add, scale, sub; simpl; ring).
      rewrite YY, XY, YZ; ring. }
    split; apply Rmult_eq_reg_l with F; try lra.
    - rewrite <- X; unfold dot, x_axis, K; simpl; field; lra.
    - replace (F * rate_x) with (- dot (Vec jx jy jz) y_axis) by lra.
      unfold dot, y_axis; simpl; field; lra.
  Qed.

  (** The x axis stays level with the heading: its change along what is left of the heading
      makes up for the heading's own. *)
  Hypothesis level : vy (sub (scale rate_z y_axis) (scale rate_y z_axis)) = turn * vx x_axis.

  Theorem level_rate : rate_z = (turn * w * F + q * K / F) / D.
  Proof.
    destruct rates as [Y _]; assert (H := level); unfold sub, scale, y_axis, z_axis, x_axis in H; simpl in H.
    assert (D0 : D <> 0) by (unfold D; apply Rmult_integral_contrapositive; lra).
    apply Rmult_eq_reg_r with (D / (F * G)).
    - replace (rate_z * (D / (F * G))) with (turn * (w / G) + rate_y * (q / F)) by lra.
      rewrite Y; field; lra.
    - intros Z; apply D0; apply Rmult_eq_compat_r with (r := F * G) in Z.
      replace (D / (F * G) * (F * G)) with D in Z by (field; lra); lra.
  Qed.
End Body.

(** The second derivative turned into the body is the change of (F rate_y, -F rate_x, F')
    and what the body's turning adds. *)
Theorem accelerations : forall F F' x y z x' y' along_x along_y, F <> 0 ->
  along_x = (F' * y + F * y') + (y * F' + z * (F * x)) ->
  along_y = - (F' * x + F * x') + (z * (F * y) - x * F') ->
  y' = (along_x - 2 * F' * y) / F - z * x /\ x' = - (along_y + 2 * F' * x) / F + y * z.
Proof. intros F F' x y z x' y' ax ay N -> ->; split; field; auto. Qed.

(** The rate about z is N / (F D); each factor changes. *)
Theorem yaw_acceleration : forall F D z F' D' z' N', F <> 0 -> D <> 0 ->
  N' = z' * (F * D) + z * (F' * D + F * D') -> z' = N' / (F * D) - z * (F' / F + D' / D).
Proof. intros F D z F' D' z' N' NF ND ->; field; auto. Qed.

(** ** Rotors

    At (sx, sy) d, with sx, sy = +-1, a rotor pushes by [push]; torques are those that the
    four have together, about z by [kappa] for each unit of thrust. *)

Definition push (lift tx ty tz d kappa sx sy : R) : R :=
  lift / 4 + sy * tx / (4 * d) - sx * ty / (4 * d) + sx * sy * tz / (4 * kappa).

Theorem rotors_share : forall lift tx ty tz d kappa, d <> 0 -> kappa <> 0 ->
  let f := push lift tx ty tz d kappa in
  f 1 1 + f (-1) 1 + f 1 (-1) + f (-1) (-1) = lift /\
  d * (f 1 1 + f (-1) 1 - f 1 (-1) - f (-1) (-1)) = tx /\
  - d * (f 1 1 - f (-1) 1 + f 1 (-1) - f (-1) (-1)) = ty /\
  kappa * (f 1 1 - f (-1) 1 - f 1 (-1) + f (-1) (-1)) = tz.
Proof. intros lift tx ty tz d kappa Nd Nk f; unfold f, push; repeat split; field; auto. Qed.
