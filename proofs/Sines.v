(** Sines and cosines by Taylor's sums in rounded numbers, less full turns. *)

Require Import Reals Lra Lia Psatz ZArith.
From LtlPlan Require Import Pairs Intervals.
Open Scope R_scope.

(** ** Taylor's sums: what they leave out is less than the next term *)

(** The derivatives of cosine and sine at 0: 1, 0, -1, 0 ... and 0, 1, 0, -1 ... *)
Fixpoint cosines (k : nat) : R := match k with O => 1 | S j => - sines j end
with sines (k : nat) : R := match k with O => 0 | S j => cosines j end.

Fixpoint term (k : nat) (x : R) : R :=
  match k with O => 1 | S j => term j x * x / INR (S j) end.

Fixpoint cosine_sum (n : nat) (x : R) : R :=
  match n with O => 0 | S m => cosine_sum m x + cosines m * term m x end.
Fixpoint sine_sum (n : nat) (x : R) : R :=
  match n with O => 0 | S m => sine_sum m x + sines m * term m x end.

Lemma unit_steps : forall k, Rabs (cosines k) <= 1 /\ Rabs (sines k) <= 1.
Proof.
  induction k as [|k [IC IS]]; cbn [cosines sines]; [rewrite Rabs_R1, Rabs_R0; lra|].
  rewrite Rabs_Ropp; auto.
Qed.

Lemma next_real : forall k, 0 < INR (S k).
Proof. intros; apply lt_0_INR; lia. Qed.

Lemma term_nonneg : forall k x, 0 <= x -> 0 <= term k x.
Proof.
  induction k as [|k IH]; intros x H; cbn [term]; [lra|].
  pose proof (next_real k) as N; specialize (IH x H).
  apply Rmult_le_pos; [apply Rmult_le_pos; auto | apply Rlt_le, Rinv_0_lt_compat; auto].
Qed.

Lemma term_zero : forall k, term (S k) 0 = 0.
Proof. intros; cbn [term]; unfold Rdiv; ring. Qed.

Lemma term_opposite : forall k x, term k (- x) = (if Nat.even k then 1 else -1) * term k x.
Proof.
  induction k as [|k IH]; intros x; [cbn; ring|]; cbn [term]; rewrite IH, Nat.even_succ, <- Nat.negb_even.
  destruct (Nat.even k); cbn [negb]; unfold Rdiv; ring.
Qed.

Lemma term_powers : forall k x, term (S k) x * INR (S k) = term k x * x.
Proof. intros k x; cbn [term]; pose proof (next_real k); field; lra. Qed.

Lemma term_slope : forall k x, derivable_pt_lim (term (S k)) x (term k x).
Proof.
  induction k as [|k IH]; intros x.
  - cbn [term INR]; apply (derivable_pt_lim_ext (fun x => x)).
    + intros y; field.
    + apply derivable_pt_lim_id.
  - apply (derivable_pt_lim_ext (fun y => / INR (S (S k)) * (term (S k) y * y))).
    { intros y; change (term (S (S k)) y) with (term (S k) y * y / INR (S (S k))); unfold Rdiv; ring. }
    replace (term (S k) x) with (/ INR (S (S k)) * (term k x * x + term (S k) x * 1)).
    + apply (derivable_pt_lim_scal (fun y => term (S k) y * y)).
      apply (derivable_pt_lim_mult (term (S k)) (fun y => y)); [apply IH | apply derivable_pt_lim_id].
    + rewrite <- term_powers; rewrite (S_INR (S k)); pose proof (next_real k); field; lra.
Qed.

Lemma sums_slope : forall n x,
  derivable_pt_lim (cosine_sum (S n)) x (- sine_sum n x) /\
  derivable_pt_lim (sine_sum (S n)) x (cosine_sum n x).
Proof.
  induction n as [|n IH]; intros x.
  - cbn [sine_sum cosine_sum]; rewrite Ropp_0; split.
    + apply (derivable_pt_lim_ext (fun _ => 1)); [intros; cbn; ring | apply derivable_pt_lim_const].
    + apply (derivable_pt_lim_ext (fun _ => 0)); [intros; cbn; ring | apply derivable_pt_lim_const].
  - destruct (IH x) as [C D]; split.
    + change (cosine_sum (S (S n))) with (fun y => cosine_sum (S n) y + cosines (S n) * term (S n) y).
      replace (- sine_sum (S n) x) with (- sine_sum n x + cosines (S n) * term n x) by (cbn [sine_sum cosines]; ring).
      apply (derivable_pt_lim_plus (cosine_sum (S n)) (fun y => cosines (S n) * term (S n) y)); auto.
      apply (derivable_pt_lim_scal (term (S n))); apply term_slope.
    + change (sine_sum (S (S n))) with (fun y => sine_sum (S n) y + sines (S n) * term (S n) y).
      replace (cosine_sum (S n) x) with (cosine_sum n x + sines (S n) * term n x) by (cbn [cosine_sum sines]; ring).
      apply (derivable_pt_lim_plus (sine_sum (S n)) (fun y => sines (S n) * term (S n) y)); auto.
      apply (derivable_pt_lim_scal (term (S n))); apply term_slope.
Qed.

(** Where the slope is less than another function's, so is the change. *)
Lemma grows_less : forall f f' g g' x, 0 <= x ->
  (forall t, 0 <= t <= x -> derivable_pt_lim f t (f' t)) ->
  (forall t, 0 <= t <= x -> derivable_pt_lim g t (g' t)) ->
  (forall t, 0 <= t <= x -> f' t <= g' t) -> f x - f 0 <= g x - g 0.
Proof.
  intros f f' g g' x H Df Dg L.
  pose proof (mean_value (fun t => f t - g t) (fun t => f' t - g' t) 0 x 0 H) as M.
  assert (f x - g x - (f 0 - g 0) <= 0 * (x - 0)); [|lra].
  apply M.
  - intros t Ht; apply (derivable_pt_lim_minus f g); auto.
  - intros t Ht; specialize (L t Ht); lra.
Qed.

Lemma sums_at_zero : forall n, cosine_sum (S n) 0 = 1 /\ sine_sum (S n) 0 = 0.
Proof.
  induction n as [|n [C D]]; [cbn; split; ring|].
  change (cosine_sum (S (S n)) 0) with (cosine_sum (S n) 0 + cosines (S n) * term (S n) 0).
  change (sine_sum (S (S n)) 0) with (sine_sum (S n) 0 + sines (S n) * term (S n) 0).
  rewrite term_zero, C, D; split; ring.
Qed.

Lemma taylor_ahead : forall n x, 0 <= x ->
  (- term n x <= cos x - cosine_sum n x <= term n x) /\ (- term n x <= sin x - sine_sum n x <= term n x).
Proof.
  induction n as [|n IH]; intros x H.
  - cbn; pose proof (COS_bound x); pose proof (SIN_bound x); lra.
  - destruct (sums_at_zero n) as [C0 S0]; pose proof (term_zero n) as T0.
    assert (DT : forall t, derivable_pt_lim (term (S n)) t (term n t)) by (intros; apply term_slope).
    assert (DN : forall t, derivable_pt_lim (fun t => - term (S n) t) t (- term n t))
      by (intros; apply (derivable_pt_lim_opp (term (S n))), DT).
    assert (DC : forall t, derivable_pt_lim (fun t => cos t - cosine_sum (S n) t) t (- sin t - - sine_sum n t)).
    { intros t; apply (derivable_pt_lim_minus cos (cosine_sum (S n)));
        [apply derivable_pt_lim_cos | apply sums_slope]. }
    assert (DS : forall t, derivable_pt_lim (fun t => sin t - sine_sum (S n) t) t (cos t - cosine_sum n t)).
    { intros t; apply (derivable_pt_lim_minus sin (sine_sum (S n)));
        [apply derivable_pt_lim_sin | apply sums_slope]. }
    split; split.
    + pose proof (grows_less (fun t => - term (S n) t) _ (fun t => cos t - cosine_sum (S n) t) _ x H
        (fun t _ => DN t) (fun t _ => DC t)) as G; cbv beta in G.
      rewrite C0, T0, cos_0 in G; assert (- term (S n) x - - 0 <= cos x - cosine_sum (S n) x - (1 - 1)); [|lra].
      apply G; intros t Ht; destruct (IH t) as [_ ?]; lra.
    + pose proof (grows_less (fun t => cos t - cosine_sum (S n) t) _ (term (S n)) _ x H
        (fun t _ => DC t) (fun t _ => DT t)) as G; cbv beta in G.
      rewrite C0, T0, cos_0 in G; assert (cos x - cosine_sum (S n) x - (1 - 1) <= term (S n) x - 0); [|lra].
      apply G; intros t Ht; destruct (IH t) as [_ ?]; lra.
    + pose proof (grows_less (fun t => - term (S n) t) _ (fun t => sin t - sine_sum (S n) t) _ x H
        (fun t _ => DN t) (fun t _ => DS t)) as G; cbv beta in G.
      rewrite S0, T0, sin_0 in G; assert (- term (S n) x - - 0 <= sin x - sine_sum (S n) x - (0 - 0)); [|lra].
      apply G; intros t Ht; destruct (IH t) as [? _]; lra.
    + pose proof (grows_less (fun t => sin t - sine_sum (S n) t) _ (term (S n)) _ x H
        (fun t _ => DS t) (fun t _ => DT t)) as G; cbv beta in G.
      rewrite S0, T0, sin_0 in G; assert (sin x - sine_sum (S n) x - (0 - 0) <= term (S n) x - 0); [|lra].
      apply G; intros t Ht; destruct (IH t) as [? _]; lra.
Qed.

Lemma steps_even : forall k, (Nat.even k = true -> sines k = 0) /\ (Nat.even k = false -> cosines k = 0).
Proof.
  induction k as [|k [E O]]; [split; [reflexivity | discriminate]|].
  cbn [cosines sines]; rewrite Nat.even_succ, <- Nat.negb_even; destruct (Nat.even k); cbn [negb]; split;
    try discriminate; intros _; [rewrite E | apply O]; auto; ring.
Qed.

Lemma sums_opposite : forall n x, cosine_sum n (- x) = cosine_sum n x /\ sine_sum n (- x) = - sine_sum n x.
Proof.
  induction n as [|n IH]; intros x; [cbn; split; ring|]; destruct (IH x) as [C D].
  cbn [cosine_sum sine_sum]; rewrite C, D, term_opposite; destruct (steps_even n) as [E O].
  destruct (Nat.even n); [rewrite E by auto | rewrite O by auto]; split; ring.
Qed.

Theorem taylor : forall n x,
  Rabs (cos x - cosine_sum n x) <= Rabs (term n x) /\ Rabs (sin x - sine_sum n x) <= Rabs (term n x).
Proof.
  intros n x; destruct (Rle_lt_dec 0 x) as [H|H].
  - destruct (taylor_ahead n x H) as [C S]; pose proof (term_nonneg n x H).
    rewrite (Rabs_right (term n x)) by lra; split; apply Rabs_le; auto.
  - destruct (taylor_ahead n (- x)) as [C S]; [lra|]; pose proof (term_nonneg n (- x)).
    destruct (sums_opposite n x) as [EC ES]; rewrite EC, cos_neg in C; rewrite ES, sin_neg in S.
    assert (A : Rabs (term n x) = term n (- x)).
    { rewrite <- (Rabs_right (term n (- x))) by lra; rewrite term_opposite, Rabs_mult.
      replace (Rabs (if Nat.even n then 1 else -1)) with 1; [ring|].
      destruct (Nat.even n); [rewrite Rabs_R1 | rewrite Rabs_left]; lra. }
    rewrite A; split; apply Rabs_le; lra.
Qed.

Lemma between : forall u e, Rabs u <= e -> - e <= u <= e.
Proof. intros u e H; pose proof (Rle_abs u); pose proof (Rle_abs (- u)); rewrite Rabs_Ropp in *; lra. Qed.

(** ** Rounded terms *)

Section Rounded.
  Variables (x eps : R) (t : nat -> R).
  Hypothesis small : Rabs x <= 4.
  Hypothesis first_term : t O = 1.
  Hypothesis next_term : forall k, Rabs (t (S k) - t k * x / INR (S k)) <= eps.

  Lemma term_step : forall k e, Rabs (t k - term k x) <= e ->
    Rabs (t (S k) - term (S k) x) <= e * (4 / INR (S k)) + eps.
  Proof.
    intros k e H; pose proof (next_real k) as N; cbn [term].
    replace (t (S k) - term k x * x / INR (S k))
      with ((t k - term k x) * (x / INR (S k)) + (t (S k) - t k * x / INR (S k))) by (field; lra).
    eapply Rle_trans; [apply Rabs_triang|]; apply Rplus_le_compat; auto.
    rewrite Rabs_mult; apply Rmult_le_compat; auto using Rabs_pos.
    unfold Rdiv; rewrite Rabs_mult, (Rabs_right (/ _)) by (apply Rle_ge, Rlt_le, Rinv_0_lt_compat; auto).
    apply Rmult_le_compat_r; auto; apply Rlt_le, Rinv_0_lt_compat; auto.
  Qed.

  (** Errors grow over the first four terms, and no more. *)
  Lemma term_near : forall k, Rabs (t k - term k x) <= 6 * eps.
  Proof.
    assert (E : 0 <= eps) by (eapply Rle_trans; [apply Rabs_pos | apply (next_term O)]).
    assert (T0 : Rabs (t 0%nat - term 0 x) <= 0) by (rewrite first_term; cbn [term]; rewrite Rminus_diag_eq, Rabs_R0; lra).
    assert (T1 := term_step 0 _ T0); assert (T2 := term_step 1 _ T1).
    assert (T3 := term_step 2 _ T2); assert (T4 := term_step 3 _ T3).
    cbn [INR] in T1, T2, T3, T4.
    assert (L : forall k, (4 <= k)%nat -> Rabs (t k - term k x) <= 6 * eps).
    { intros k Hk; induction Hk as [|k Hk IH]; [lra|]; apply term_step in IH.
      assert (N : 5 <= INR (S k)) by (replace 5 with (INR 5) by (cbn; lra); apply le_INR; lia).
      assert (D : 4 / INR (S k) <= 4 / 5).
      { apply Rmult_le_compat_l; [lra | apply Rinv_le_contravar; lra]. }
      assert (6 * eps * (4 / INR (S k)) <= 6 * eps * (4 / 5)) by (apply Rmult_le_compat_l; lra). lra. }
    intros [|[|[|[|k]]]]; [| | | | apply L; lia]; eapply Rle_trans; try eassumption; lra.
  Qed.

  Fixpoint summed (c : nat -> R) (n : nat) : R :=
    match n with O => 0 | S m => summed c m + c m * t m end.

  Lemma summed_near : forall n,
    Rabs (summed cosines n - cosine_sum n x) <= INR n * (6 * eps) /\
    Rabs (summed sines n - sine_sum n x) <= INR n * (6 * eps).
  Proof.
    assert (One : forall c k, Rabs c <= 1 -> Rabs (c * t k - c * term k x) <= 6 * eps).
    { intros c k H; rewrite <- Rmult_minus_distr_l, Rabs_mult; pose proof (term_near k).
      pose proof (Rabs_pos (t k - term k x)); pose proof (Rabs_pos c); nra. }
    induction n as [|n [C D]]; cbn [summed cosine_sum sine_sum].
    - cbn [INR]; rewrite Rminus_diag_eq, Rabs_R0 by auto; lra.
    - rewrite S_INR; destruct (unit_steps n) as [UC US]; split.
      + replace (summed cosines n + cosines n * t n - (cosine_sum n x + cosines n * term n x))
          with ((summed cosines n - cosine_sum n x) + (cosines n * t n - cosines n * term n x)) by ring.
        eapply Rle_trans; [apply Rabs_triang|]; specialize (One _ n UC); lra.
      + replace (summed sines n + sines n * t n - (sine_sum n x + sines n * term n x))
          with ((summed sines n - sine_sum n x) + (sines n * t n - sines n * term n x)) by ring.
        eapply Rle_trans; [apply Rabs_triang|]; specialize (One _ n US); lra.
  Qed.

  Theorem taylor_rounded : forall n,
    Rabs (cos x - summed cosines n) <= Rabs (t n) + 6 * (INR n + 1) * eps /\
    Rabs (sin x - summed sines n) <= Rabs (t n) + 6 * (INR n + 1) * eps.
  Proof.
    intros n; destruct (taylor n x) as [C D]; destruct (summed_near n) as [E F].
    pose proof (term_near n) as T; rewrite <- Rabs_Ropp in T, E, F.
    assert (B : Rabs (term n x) <= Rabs (t n) + 6 * eps).
    { replace (term n x) with (t n + - (t n - term n x)) by ring.
      eapply Rle_trans; [apply Rabs_triang | lra]. }
    split.
    - replace (cos x - summed cosines n) with ((cos x - cosine_sum n x) + - (summed cosines n - cosine_sum n x)) by ring.
      eapply Rle_trans; [apply Rabs_triang | lra].
    - replace (sin x - summed sines n) with ((sin x - sine_sum n x) + - (summed sines n - sine_sum n x)) by ring.
      eapply Rle_trans; [apply Rabs_triang | lra].
  Qed.
End Rounded.

(** ** Pi, by the signs of two sines *)

Section Whole.
  (** x is [num] / [den]; terms are whole numbers over [fine]. *)
  Variables (num den fine : Z).
  Hypothesis den_positive : (0 < den)%Z.
  Hypothesis fine_positive : (0 < fine)%Z.

  Fixpoint whole_term (k : nat) : Z :=
    match k with O => fine | S j => (whole_term j * num) / (den * Z.of_nat (S j)) end.

  Definition x : R := IZR num / IZR den.
  Definition t (k : nat) : R := IZR (whole_term k) / IZR fine.

  Lemma whole_next : forall k, Rabs (t (S k) - t k * x / INR (S k)) <= / IZR fine.
  Proof.
    intros k; unfold t, x; cbn [whole_term]; set (n := (whole_term k * num)%Z); set (d := (den * Z.of_nat (S k))%Z).
    assert (D : (0 < d)%Z) by (unfold d; lia).
    pose proof (floor_below n d) as F; unfold floor_over in F.
    assert (E : IZR n = IZR d * IZR (n / d) + IZR (n mod d))
      by (rewrite <- mult_IZR, <- plus_IZR; f_equal; apply Z.div_mod; lia).
    assert (M : IZR (n mod d) < IZR d) by (apply IZR_lt, Z.mod_pos_bound; auto).
    assert (M0 : 0 <= IZR (n mod d)) by (apply IZR_le, Z.mod_pos_bound; auto).
    assert (DR : 0 < IZR d) by (apply IZR_lt; auto). assert (FR : 0 < IZR fine) by (apply IZR_lt; auto).
    assert (NR : 0 < IZR den) by (apply IZR_lt; auto). pose proof (next_real k) as KR.
    assert (Q : IZR (whole_term k) / IZR fine * (IZR num / IZR den) / INR (S k) = IZR n / IZR d / IZR fine).
    { unfold n, d; rewrite !mult_IZR, <- INR_IZR_INZ; field; repeat split; lra. }
    rewrite Q; replace (IZR (n / d) / IZR fine - IZR n / IZR d / IZR fine)
      with (- (IZR (n mod d) / IZR d) * / IZR fine) by (rewrite E; field; lra).
    rewrite Rabs_mult, (Rabs_right (/ IZR fine)) by (apply Rle_ge, Rlt_le, Rinv_0_lt_compat; auto).
    rewrite <- (Rmult_1_l (/ IZR fine)) at 2; apply Rmult_le_compat_r; [apply Rlt_le, Rinv_0_lt_compat; auto|].
    rewrite Rabs_Ropp, Rabs_right by (apply Rle_ge, Rmult_le_pos; auto; apply Rlt_le, Rinv_0_lt_compat; auto).
    apply Rmult_le_reg_r with (IZR d); auto; replace (IZR (n mod d) / IZR d * IZR d) with (IZR (n mod d)) by (field; lra); lra.
  Qed.

  Fixpoint whole_sines (k : nat) : Z * Z :=
    match k with O => (0, 1)%Z | S j => let (s, c) := whole_sines j in (c, - s)%Z end.

  Fixpoint whole_sum (n : nat) : Z :=
    match n with O => 0%Z | S m => (whole_sum m + fst (whole_sines m) * whole_term m)%Z end.

  (** The same sum, term after term. *)
  Fixpoint whole_run (n k : nat) (now sum s c : Z) : Z :=
    match n with
    | O => sum
    | S m => whole_run m (S k) ((now * num) / (den * Z.of_nat (S k))) (sum + s * now)%Z c (- s)%Z
    end.

  Lemma whole_run_sum : forall n k,
    whole_run n k (whole_term k) (whole_sum k) (fst (whole_sines k)) (snd (whole_sines k)) = whole_sum (n + k).
  Proof.
    induction n as [|n IH]; intros k; auto; cbn [whole_run].
    replace (S n + k)%nat with (n + S k)%nat by lia; rewrite <- (IH (S k)); cbn [whole_term whole_sum whole_sines].
    destruct (whole_sines k); auto.
  Qed.

  Lemma whole_steps : forall k, IZR (fst (whole_sines k)) = sines k /\ IZR (snd (whole_sines k)) = cosines k.
  Proof.
    induction k as [|k [E F]]; [split; reflexivity|]; cbn [whole_sines sines cosines].
    destruct (whole_sines k) as [s c]; cbn in *; rewrite opp_IZR, E; auto.
  Qed.

  Lemma whole_summed : forall n, IZR (whole_sum n) / IZR fine = summed t sines n.
  Proof.
    assert (FR : 0 < IZR fine) by (apply IZR_lt; auto).
    induction n as [|n IH]; cbn [whole_sum summed]; [unfold Rdiv; ring|].
    rewrite plus_IZR, mult_IZR, <- IH; destruct (whole_steps n) as [-> _]; unfold t; field; lra.
  Qed.

  Theorem sine_near : forall n, Rabs x <= 4 ->
    Rabs (sin x * IZR fine - IZR (whole_sum n)) <= Rabs (IZR (whole_term n)) + 6 * (INR n + 1).
  Proof.
    intros n X; assert (FR : 0 < IZR fine) by (apply IZR_lt; auto).
    assert (T0 : t 0 = 1) by (unfold t; cbn [whole_term]; field; lra).
    destruct (taylor_rounded x (/ IZR fine) t X T0 whole_next n) as [_ S]; rewrite <- whole_summed in S.
    replace (sin x * IZR fine - IZR (whole_sum n)) with ((sin x - IZR (whole_sum n) / IZR fine) * IZR fine) by (field; lra).
    rewrite Rabs_mult, (Rabs_right (IZR fine)) by lra.
    apply Rmult_le_compat_r with (r := IZR fine) in S; [|lra].
    eapply Rle_trans; [exact S|]; rewrite Rmult_plus_distr_r; apply Req_le; f_equal; [|field; lra].
    unfold t, Rdiv; rewrite Rabs_mult, (Rabs_right (/ IZR fine)); [field; lra|].
    apply Rle_ge, Rlt_le, Rinv_0_lt_compat; auto.
  Qed.
End Whole.

Definition pi_below : Z := 3141592653589793238462643383279502884197.
Definition pi_unit : Z := 10 ^ 39.

Lemma sine_sign : forall num den fine n s e, (0 < den)%Z -> (0 < fine)%Z -> (0 <= num <= 4 * den)%Z ->
  whole_run num den n 0 fine 0 0 1 = s -> (Z.abs (whole_term num den fine n) + 6 * (Z.of_nat n + 1) <= e)%Z ->
  ((e < s)%Z -> 0 < sin (x num den)) /\ ((s < - e)%Z -> sin (x num den) < 0).
Proof.
  intros num den fine n s e D F X R E.
  pose proof (whole_run_sum num den fine n 0) as W; cbn [whole_term whole_sum whole_sines fst snd] in W.
  rewrite R, Nat.add_0_r in W; clear R; subst s.
  assert (DR : 0 < IZR den) by (apply IZR_lt; auto). assert (FR : 0 < IZR fine) by (apply IZR_lt; auto).
  assert (A : Rabs (x num den) <= 4).
  { destruct X as [X0 X4]; apply IZR_le in X0, X4; rewrite mult_IZR in X4; unfold x.
    rewrite Rabs_right by (apply Rle_ge, Rmult_le_pos; auto; apply Rlt_le, Rinv_0_lt_compat; auto).
    apply Rmult_le_reg_r with (IZR den); auto; replace (IZR num / IZR den * IZR den) with (IZR num) by (field; lra); lra. }
  pose proof (sine_near num den fine D F n A) as N.
  apply IZR_le in E; rewrite plus_IZR, mult_IZR, plus_IZR, <- INR_IZR_INZ, abs_IZR in E.
  assert (B : Rabs (sin (x num den) * IZR fine - IZR (whole_sum num den fine n)) <= IZR e) by lra.
  apply between in B; split; intros L; apply IZR_lt in L; rewrite ?opp_IZR in L; apply Rnot_le_lt; intros K; nra.
Qed.

(** (Coq's own bound rests on one more axiom.) *)
Lemma pi_above_two : 2 < PI.
Proof.
  apply Rnot_le_lt; intros L; pose proof PI_RGT_0 as P; pose proof sin_PI as Z.
  destruct (taylor_ahead 3 PI) as [_ [S _]]; [lra|]; cbn in S; nra.
Qed.

Theorem pi_between : IZR pi_below / IZR pi_unit < PI < IZR (pi_below + 1) / IZR pi_unit.
Proof.
  assert (U : (0 < pi_unit)%Z) by (vm_compute; auto).
  assert (DR : 0 < IZR pi_unit) by (apply IZR_lt; auto).
  assert (W : (0 < 2 ^ 192)%Z) by (vm_compute; auto).
  assert (S : forall c, (0 <= c <= 4 * pi_unit)%Z -> 0 <= x c pi_unit <= 4).
  { intros c [C0 C4]; apply IZR_le in C0, C4; rewrite mult_IZR in C4; unfold x; split.
    - apply Rmult_le_pos; auto; apply Rlt_le, Rinv_0_lt_compat; auto.
    - apply Rmult_le_reg_r with (IZR pi_unit); auto.
      replace (IZR c / IZR pi_unit * IZR pi_unit) with (IZR c) by (field; lra); lra. }
  pose proof pi_above_two as P2; split.
  - assert (C : (0 <= pi_below <= 4 * pi_unit)%Z) by (vm_compute; split; discriminate).
    destruct (sine_sign pi_below pi_unit (2 ^ 192) 64 _ 1000 U W C eq_refl) as [Above _].
    + vm_compute; discriminate.
    + specialize (S _ C); fold (x pi_below pi_unit); apply Rnot_le_lt; intros L.
      assert (sin (x pi_below pi_unit) <= 0) by (apply sin_le_0; lra).
      assert (0 < sin (x pi_below pi_unit)) by (apply Above; vm_compute; reflexivity). lra.
  - assert (C : (0 <= pi_below + 1 <= 4 * pi_unit)%Z) by (vm_compute; split; discriminate).
    destruct (sine_sign (pi_below + 1) pi_unit (2 ^ 192) 64 _ 1000 U W C eq_refl) as [_ Below].
    + vm_compute; discriminate.
    + specialize (S _ C); fold (x (pi_below + 1) pi_unit); apply Rnot_le_lt; intros L.
      assert (0 <= sin (x (pi_below + 1) pi_unit)) by (apply sin_ge_0; lra).
      assert (sin (x (pi_below + 1) pi_unit) < 0) by (apply Below; vm_compute; reflexivity). lra.
Qed.

(** ** Full turns, and angles beside one *)

Theorem cosine_near : forall u v, Rabs (cos u - cos v) <= Rabs (u - v).
Proof.
  assert (H : forall a b, a <= b -> Rabs (cos b - cos a) <= b - a).
  { intros a b L; apply Rabs_le; split.
    - pose proof (mean_value (fun t => - cos t) (fun t => - - sin t) a b 1 L) as M; cbv beta in M.
      assert (- cos b - - cos a <= 1 * (b - a)); [|lra]. apply M.
      + intros t _; apply (derivable_pt_lim_opp cos), derivable_pt_lim_cos.
      + intros t _; pose proof (SIN_bound t); lra.
    - pose proof (mean_value cos (fun t => - sin t) a b 1 L) as M.
      assert (cos b - cos a <= 1 * (b - a)); [|lra]. apply M.
      + intros t _; apply derivable_pt_lim_cos.
      + intros t _; pose proof (SIN_bound t); lra. }
  intros u v; destruct (Rle_lt_dec v u) as [L|L].
  - rewrite (Rabs_right (u - v)) by lra; apply H; auto.
  - rewrite (Rabs_left (u - v)), Rabs_minus_sym by lra.
    replace (- (u - v)) with (v - u) by ring; apply H; lra.
Qed.

Theorem sine_near_by : forall u v, Rabs (sin u - sin v) <= Rabs (u - v).
Proof.
  intros u v; rewrite <- !cos_shift; pose proof (cosine_near (PI / 2 - u) (PI / 2 - v)) as C.
  rewrite Rabs_minus_sym in C; replace (PI / 2 - u - (PI / 2 - v)) with (- (u - v)) in C by ring.
  rewrite Rabs_Ropp, Rabs_minus_sym in C; auto.
Qed.

Theorem whole_turns : forall k a, cos (a - 2 * IZR k * PI) = cos a /\ sin (a - 2 * IZR k * PI) = sin a.
Proof.
  assert (N : forall n a, cos (a + 2 * INR n * PI) = cos a /\ sin (a + 2 * INR n * PI) = sin a)
    by (intros; split; [apply cos_period | apply sin_period]).
  intros k a; destruct (Z_le_gt_dec 0 k) as [L|G].
  - assert (E : IZR k = INR (Z.to_nat k)) by (rewrite INR_IZR_INZ, Z2Nat.id; auto).
    destruct (N (Z.to_nat k) (a - 2 * IZR k * PI)) as [C S]; rewrite <- E in C, S.
    replace (a - 2 * IZR k * PI + 2 * IZR k * PI) with a in C, S by ring; auto.
  - assert (E : - IZR k = INR (Z.to_nat (- k))) by (rewrite INR_IZR_INZ, Z2Nat.id, opp_IZR; auto; lia).
    destruct (N (Z.to_nat (- k)) a) as [C S]; rewrite <- E in C, S.
    replace (a + 2 * - IZR k * PI) with (a - 2 * IZR k * PI) in C, S by ring; auto.
Qed.

(** Taylor's sums in intervals: what they leave out is no more than the next term. *)

Theorem taylor_within : forall unit n x c s t r, (0 < unit)%Z ->
  contains unit c (cosine_sum n x) -> contains unit s (sine_sum n x) -> contains unit t (term n x) ->
  (Z.max (- low t) (high t) <= r)%Z ->
  contains unit (plus c (Interval (- r) r)) (cos x) /\ contains unit (plus s (Interval (- r) r)) (sin x).
Proof.
  intros unit n x c s t r U [C1 C2] [S1 S2] [T1 T2] L.
  assert (UR : 0 < IZR unit) by (apply IZR_lt; auto).
  assert (L1 : IZR (- low t) <= IZR r) by (apply IZR_le; lia); rewrite opp_IZR in L1.
  assert (L2 : IZR (high t) <= IZR r) by (apply IZR_le; lia).
  destruct (taylor n x) as [C S]; apply between in C, S.
  assert (T : Rabs (term n x) * IZR unit <= IZR r).
  { rewrite <- (Rabs_right (IZR unit)) by lra; rewrite <- Rabs_mult; apply Rabs_le; lra. }
  unfold contains, plus; cbn [low high]; rewrite !plus_IZR, !opp_IZR; split; nra.
Qed.

(** Of angles beside one whose cosine an interval holds; the same of sines. *)
Theorem beside : forall unit i c v a b away, (0 < unit)%Z -> -1 <= v <= 1 -> Rabs (v - c) <= Rabs (a - b) ->
  contains unit i c -> Rabs (a - b) * IZR unit <= IZR away ->
  contains unit (Interval (Z.max (low i - away) (- unit)) (Z.min (high i + away) unit)) v.
Proof.
  intros unit i c v a b away U V N [I1 I2] A; unfold contains; cbn [low high].
  assert (UR : 0 < IZR unit) by (apply IZR_lt; auto).
  assert (D : Rabs (v - c) * IZR unit <= IZR away) by nra.
  assert (E : - IZR away <= (v - c) * IZR unit <= IZR away).
  { apply between; rewrite Rabs_mult, (Rabs_right (IZR unit)); lra. }
  split.
  - destruct (Z.max_spec (low i - away) (- unit)) as [[_ ->]|[_ ->]]; rewrite ?minus_IZR, ?opp_IZR; nra.
  - destruct (Z.min_spec (high i + away) unit) as [[_ ->]|[_ ->]]; rewrite ?plus_IZR; nra.
Qed.
