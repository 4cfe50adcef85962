(** Bernstein polynomials on an interval, over the reals.

    A polynomial of degree n is given by its coefficients b_0 ... b_n.  A point
    of the interval is given by weights: s of the left end, t of the right end. *)

Require Import Reals Lra Lia Arith.
Open Scope R_scope.

Fixpoint bern (n : nat) (b : nat -> R) (s t : R) : R :=
  match n with
  | O => b O
  | S m => s * bern m b s t + t * bern m (fun i => b (S i)) s t
  end.

Lemma bern_ext : forall n b c s t,
  (forall i, (i <= n)%nat -> b i = c i) -> bern n b s t = bern n c s t.
Proof.
  induction n as [|n IH]; intros b c s t H; simpl.
  - apply H; lia.
  - f_equal; f_equal; apply IH; intros i Hi; apply H; lia.
Qed.

(** The interval read from its other end. *)
Lemma bern_swap : forall n b s t, bern n (fun i => b (n - i)%nat) s t = bern n b t s.
Proof.
  induction n as [|n IH]; intros b s t; [reflexivity|].
  assert (E : forall n b s t, bern (S n) b s t
    = s * bern n b s t + t * bern n (fun i => b (S i)) s t) by reflexivity.
  rewrite !E.
  rewrite (bern_ext n _ (fun i => b (S (n - i)))) by (intros; f_equal; lia).
  rewrite (bern_ext n (fun i => b (S n - S i)%nat) (fun i => b (n - i)%nat)) by auto.
  rewrite (IH (fun i => b (S i))), IH; ring.
Qed.

(** ** The textbook's sum *)

Fixpoint sum (n : nat) (f : nat -> R) : R :=
  match n with O => 0 | S m => sum m f + f m end.

Fixpoint choose (n i : nat) : nat :=
  match n, i with
  | _, O => 1
  | O, S _ => 0
  | S m, S j => choose m j + choose m (S j)
  end.

Lemma sum_ext : forall n f g, (forall i, (i < n)%nat -> f i = g i) -> sum n f = sum n g.
Proof.
  induction n as [|n IH]; intros f g H; simpl; auto.
  rewrite (IH f g); [rewrite H; auto|]; intros; apply H; lia.
Qed.

Lemma sum_last : forall n f, sum (S n) f = sum n f + f n.
Proof. reflexivity. Qed.

Lemma sum_first : forall n f, sum (S n) f = f O + sum n (fun i => f (S i)).
Proof.
  induction n as [|n IH]; intros f; [simpl; ring|].
  rewrite (sum_last (S n)). rewrite IH. simpl; ring.
Qed.

Lemma sum_plus : forall n f g, sum n (fun i => f i + g i) = sum n f + sum n g.
Proof. induction n as [|n IH]; intros; simpl; [ring | rewrite IH; ring]. Qed.

Lemma sum_scale : forall n k f, sum n (fun i => k * f i) = k * sum n f.
Proof. induction n as [|n IH]; intros; simpl; [ring | rewrite IH; ring]. Qed.

Lemma choose_above : forall n i, (n < i)%nat -> choose n i = 0%nat.
Proof.
  induction n as [|n IH]; intros [|i] H; simpl; try lia; auto.
  rewrite !IH; lia.
Qed.

Lemma choose_0 : forall n, choose n 0 = 1%nat.
Proof. now intros [|n]. Qed.

Theorem bern_sum : forall n b s t,
  bern n b s t = sum (S n) (fun i => INR (choose n i) * b i * s ^ (n - i) * t ^ i).
Proof.
  induction n as [|n IH]; intros b s t; [simpl; ring|].
  cbn [bern]; rewrite !IH, (sum_first (S n)).
  transitivity (s * sum (S n) (fun i => INR (choose n i) * b i * s ^ (n - i) * t ^ i)
    + sum (S n) (fun i => INR (choose n i) * b (S i) * s ^ (n - i) * t ^ S i)).
  { f_equal; rewrite <- !sum_scale; apply sum_ext; intros; simpl; ring. }
  replace (s * sum (S n) (fun i => INR (choose n i) * b i * s ^ (n - i) * t ^ i))
    with (sum (S (S n)) (fun i => INR (choose n i) * b i * s ^ (S n - i) * t ^ i)).
  2:{ rewrite (sum_last (S n)); cbv beta.
      rewrite (choose_above n (S n)) by lia.
      rewrite <- sum_scale; simpl (INR 0); ring_simplify; apply sum_ext; intros i Hi.
      replace (S n - i)%nat with (S (n - i)) by lia; simpl; ring. }
  rewrite (sum_first (S n)), !choose_0, Rplus_assoc, <- sum_plus; f_equal.
  apply sum_ext; intros i Hi; cbn [choose]; rewrite plus_INR.
  replace (S n - S i)%nat with (n - i)%nat by lia; ring.
Qed.

(** ** Signs *)

Theorem bern_nonneg : forall n b s t, 0 <= s -> 0 <= t ->
  (forall i, (i <= n)%nat -> 0 <= b i) -> 0 <= bern n b s t.
Proof.
  induction n as [|n IH]; intros b s t Hs Ht H; simpl; [apply H; lia|].
  apply Rplus_le_le_0_compat; apply Rmult_le_pos; auto; apply IH; auto; intros; apply H; lia.
Qed.

Lemma bern_minus : forall n b c s t,
  bern n (fun i => b i - c i) s t = bern n b s t - bern n c s t.
Proof. induction n as [|n IH]; intros; simpl; [ring | rewrite !IH; ring]. Qed.

Lemma bern_plus : forall n b c s t,
  bern n (fun i => b i + c i) s t = bern n b s t + bern n c s t.
Proof. induction n as [|n IH]; intros; simpl; [ring | rewrite !IH; ring]. Qed.

Lemma bern_scale : forall n k b s t, bern n (fun i => k * b i) s t = k * bern n b s t.
Proof. induction n as [|n IH]; intros; simpl; [ring | rewrite !IH; ring]. Qed.

Lemma bern_homogeneous : forall n k b s t, bern n b (k * s) (k * t) = k ^ n * bern n b s t.
Proof. induction n as [|n IH]; intros; simpl; [ring | rewrite !IH; ring]. Qed.

Lemma bern_const : forall n k s t, s + t = 1 -> bern n (fun _ => k) s t = k.
Proof. induction n as [|n IH]; intros k s t H; simpl; auto. rewrite IH by auto. nra. Qed.

(** Coefficients bound the polynomial on the interval. *)
Theorem bern_lower : forall n b k s t, 0 <= s -> 0 <= t -> s + t = 1 ->
  (forall i, (i <= n)%nat -> k <= b i) -> k <= bern n b s t.
Proof.
  intros n b k s t Hs Ht H1 H.
  pose proof (bern_nonneg n (fun i => b i - k) s t Hs Ht) as P.
  rewrite bern_minus, bern_const in P by auto.
  assert (0 <= bern n b s t - k) by (apply P; intros i Hi; specialize (H i Hi); lra). lra.
Qed.

Theorem bern_upper : forall n b k s t, 0 <= s -> 0 <= t -> s + t = 1 ->
  (forall i, (i <= n)%nat -> b i <= k) -> bern n b s t <= k.
Proof.
  intros n b k s t Hs Ht H1 H.
  pose proof (bern_nonneg n (fun i => k - b i) s t Hs Ht) as P.
  rewrite bern_minus, bern_const in P by auto.
  assert (0 <= k - bern n b s t) by (apply P; intros i Hi; specialize (H i Hi); lra). lra.
Qed.

Theorem bern_positive : forall n b s t, 0 <= s -> 0 <= t -> s + t = 1 ->
  (forall i, (i <= n)%nat -> 0 < b i) -> 0 < bern n b s t.
Proof.
  induction n as [|n IH]; intros b s t Hs Ht H1 H; simpl; [apply H; lia|].
  assert (0 < bern n b s t) by (apply IH; auto).
  assert (0 < bern n (fun i => b (S i)) s t) by (apply IH; auto; intros; apply H; lia).
  destruct (Rlt_le_dec 0 s); [|assert (t = 1) by lra; subst; nra].
  apply Rplus_lt_le_0_compat; [apply Rmult_lt_0_compat | apply Rmult_le_pos]; lra.
Qed.

(** ** Coefficients from powers

    [diffs i b] is the i-th forward difference of b.  The power coefficients of a
    polynomial are a_i = choose n i * diffs i b 0, so running sums turn a_i / choose n i
    into Bernstein coefficients. *)

Definition diff (b : nat -> R) (i : nat) : R := b (S i) - b i.

Fixpoint diffs (k : nat) (b : nat -> R) : nat -> R :=
  match k with O => b | S m => diffs m (diff b) end.

Lemma bern_diff : forall n b t,
  bern (S n) b (1 - t) t = bern n b (1 - t) t + t * bern n (diff b) (1 - t) t.
Proof. intros; unfold diff; rewrite (bern_minus n (fun i => b (S i)) b); simpl; ring. Qed.

Theorem bern_power : forall n b t,
  bern n b (1 - t) t = sum (S n) (fun i => INR (choose n i) * diffs i b O * t ^ i).
Proof.
  induction n as [|n IH]; intros b t; [simpl; ring|].
  rewrite bern_diff, !IH, (sum_first (S n)).
  transitivity (sum (S (S n)) (fun i => INR (choose n i) * diffs i b O * t ^ i)
    + sum (S n) (fun i => INR (choose n i) * diffs (S i) b O * t ^ S i)).
  { f_equal.
    - rewrite (sum_last (S n)); cbv beta.
      rewrite (choose_above n (S n)) by lia; simpl (INR 0); ring.
    - rewrite <- sum_scale; apply sum_ext; intros; simpl; ring. }
  rewrite (sum_first (S n)), !choose_0, Rplus_assoc, <- sum_plus; f_equal.
  apply sum_ext; intros i Hi; cbn [choose]; rewrite plus_INR; ring.
Qed.

(** Sums of neighbours, row after row: their heads are the Bernstein coefficients
    of the polynomial with the powers' coefficients choose n i * d i. *)
Definition pairs (d : nat -> R) (i : nat) : R := d i + d (S i).

Fixpoint heads (d : nat -> R) (j : nat) : R :=
  match j with O => d O | S k => heads (pairs d) k end.

Lemma heads_plus : forall j d e, heads (fun i => d i + e i) j = heads d j + heads e j.
Proof.
  induction j as [|j IH]; intros d e; simpl; auto.
  rewrite <- IH; f_equal; apply FunctionalExtensionality.functional_extensionality; intros i.
  unfold pairs; ring.
Qed.

Lemma diff_heads : forall d j, diff (heads d) j = heads (fun i => d (S i)) j.
Proof. intros d j; unfold diff; simpl; unfold pairs; rewrite heads_plus; ring. Qed.

Lemma diffs_ext : forall k b c, (forall i, b i = c i) -> forall i, diffs k b i = diffs k c i.
Proof.
  induction k as [|k IH]; intros b c H i; simpl; auto.
  apply IH; intros j; unfold diff; rewrite !H; auto.
Qed.

Lemma diffs_heads : forall k d, diffs k (heads d) O = d k.
Proof.
  induction k as [|k IH]; intros d; simpl; auto.
  rewrite (diffs_ext k _ _ (diff_heads d)), IH; auto.
Qed.

(** L is the least common multiple of the binomials, d_i = a_i L / choose n i. *)
Theorem bern_from_powers : forall n a d L t,
  (forall i, (i <= n)%nat -> INR (choose n i) * d i = L * a i) ->
  bern n (heads d) (1 - t) t = L * sum (S n) (fun i => a i * t ^ i).
Proof.
  intros n a d L t H; rewrite bern_power, <- sum_scale; apply sum_ext; intros i Hi.
  rewrite diffs_heads, H by lia; ring.
Qed.

(** ** Growth: differences of one sign *)

Lemma bern_grows_t : forall n b s t u, 0 <= s -> 0 <= t -> 0 <= u ->
  (forall i, (i < n)%nat -> b i <= b (S i)) ->
  bern n b (s + u) t <= bern n b s (t + u).
Proof.
  induction n as [|n IH]; intros b s t u Hs Ht Hu H; simpl; [lra|].
  set (c := fun i => b (S i)).
  assert (A : bern n b (s + u) t <= bern n b s (t + u)) by (apply IH; auto).
  assert (B : bern n c (s + u) t <= bern n c s (t + u))
    by (apply IH; auto; intros; apply H; lia).
  assert (D : bern n b s (t + u) <= bern n c s (t + u)).
  { pose proof (bern_nonneg n (fun i => c i - b i) s (t + u)) as P.
    rewrite bern_minus in P. unfold c in *.
    assert (0 <= bern n (fun i => b (S i)) s (t + u) - bern n b s (t + u)); [|lra].
    apply P; try lra; intros i Hi; assert (b i <= b (S i)) by (apply H; lia); lra. }
  nra.
Qed.

(** Differences that are not negative: the polynomial does not fall. *)
Theorem bern_monotone : forall n b x y, 0 <= x -> x <= y -> y <= 1 ->
  (forall i, (i < n)%nat -> b i <= b (S i)) ->
  bern n b (1 - x) x <= bern n b (1 - y) y.
Proof.
  intros n b x y Hx Hxy Hy H.
  replace (1 - x) with ((1 - y) + (y - x)) by ring.
  replace (bern n b (1 - y) y) with (bern n b (1 - y) (x + (y - x))) by (f_equal; ring).
  apply bern_grows_t; auto; lra.
Qed.
